"""What is known about a trained policy, as the JSON file beside its weights."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from cps_envs.core.types import ROLES

FORMAT = 1
HEADS = ("gaussian", "squashed", "discrete")


@dataclass(frozen=True)
class Card:
    """Of one recipe; `seeds` has one entry per training seed, whose weights lie under its number."""

    name: str
    problem: str
    version: int  # of the environment
    role: str
    algorithm: str
    opponent: str  # trained against
    preset: str
    overrides: Mapping[str, Any]  # of the preset, while training
    recipe: Mapping[str, Any]  # every knob
    activation: str
    head: str  # gaussian: clipped means; squashed: their tanh; discrete: logits, one after the other
    decentralised: bool  # plays each agent of the role's team with the same network
    hold: int  # decisions that an action is kept for
    observation_size: int  # of the role, or of one agent of its team
    actions: tuple[int, ...]  # choices of each discrete action; (k,) for k continuous ones
    best: int  # the seed with the best validation
    seeds: Mapping[str, Mapping[str, Any]]  # steps, validation score, CPU seconds
    command: str  # that trained it
    versions: Mapping[str, str]  # of the packages
    evaluation: Mapping[str, Any] = field(default_factory=dict)  # on seeds that training never used
    format: int = FORMAT

    def __post_init__(self) -> None:
        if self.format != FORMAT:
            raise ValueError(f"it has format {self.format}, this version reads {FORMAT}: update cps-envs")
        if self.role not in ROLES or self.head not in HEADS or self.hold < 1 or str(self.best) not in self.seeds:
            raise ValueError("role, head, hold or best seed make no sense")

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def read_card(path: Path) -> Card:
    """The card of a file.

    Raises:
        ValueError: it is no such card.
        OSError: it cannot be read.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        known = {entry.name for entry in fields(Card)}
        if not isinstance(document, dict) or not set(document) <= known:
            raise ValueError("unknown entries" if isinstance(document, dict) else "no JSON object")
        return Card(**{**document, "actions": tuple(document.get("actions", ()))})
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path} is no card of a trained policy ({error}). Train or download it again.") from error
