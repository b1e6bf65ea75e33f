"""What is known about a trained policy, as the JSON file beside its weights."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from cps_agents.zoo.wiring import check_wiring
from cps_envs.core.documents import printable, read_entry
from cps_envs.core.types import ROLES

FORMAT = 1
SHIPPED = Path(__file__).with_name("policies")  # what comes with the package
HEADS = ("gaussian", "discrete")  # of networks
MOST_BYTES = 2**20  # of a card
REMEDY = "Train or download it again."
MOST_VALUES = 10**6  # of an observation, or choices of an action
KINDS: dict[str, type] = {
    **dict.fromkeys(
        ("name", "problem", "role", "algorithm", "opponent", "preset", "activation", "head", "command"), str
    ),
    **dict.fromkeys(("overrides", "recipe", "seeds", "versions", "evaluation", "wiring"), dict),
    **dict.fromkeys(("version", "observation_size", "best"), int),
    "decentralised": bool,
}
SHOWN = {str: "text", dict: "mapping", int: "whole number", bool: "truth value"}


@dataclass(frozen=True)
class Card:
    """The card of one recipe's policies; `seeds` has one entry for each training seed."""

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
    head: str  # gaussian: clipped means; discrete: logits, one after the other
    decentralised: bool  # plays each agent of the role's team with the same network
    observation_size: int  # of the role, or of one agent of its team
    actions: tuple[int, ...]  # choices of each discrete action; (k,) for k continuous ones
    best: int  # the seed with the best validation
    seeds: Mapping[str, Mapping[str, Any]]  # steps, validation score, CPU seconds
    command: str  # that trained it
    versions: Mapping[str, str]  # of the packages
    evaluation: Mapping[str, Any] = field(default_factory=dict)  # on seeds that training never used
    wiring: Mapping[str, Any] = field(default_factory=dict, repr=False)  # of a network, see `zoo.wired`
    weights: str = ""  # SHA-256 of the file with the weights, which ties it to the card; `save` fills it in
    format: int = FORMAT

    def __post_init__(self) -> None:
        if self.format != FORMAT:
            raise ValueError(f"it has format {self.format}, this version reads {FORMAT}: update cps-envs")
        for name, kind in KINDS.items():
            value = getattr(self, name)
            if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
                raise ValueError(f"{name} = {str(value)[:40]!r} is no {SHOWN[kind]}")
        if self.role not in ROLES or self.head not in HEADS or str(self.best) not in self.seeds:
            raise ValueError("role, head or best seed make no sense")
        if not 1 <= self.observation_size <= MOST_VALUES:
            raise ValueError("observation_size is out of range")
        if not self.actions or not all(type(each) is int and 1 <= each <= MOST_VALUES for each in self.actions):
            raise ValueError("actions have to be numbers of choices, each at least 1")
        if any(not (seed.isdecimal() and str(int(seed)) == seed) for seed in self.seeds):
            raise ValueError("seeds have to be named by whole numbers")
        for seed, facts in self.seeds.items():
            _check_facts(f"seeds.{seed}", facts, ("steps", "cpu_s", "validation"))
        for block, examined in self.evaluation.items():
            _check_examined(f"evaluation.{block}", examined)
        if not all(isinstance(version, str) for version in self.versions.values()):
            raise ValueError("versions have to be texts")
        check_wiring(self.wiring)

    def to_json(self) -> dict[str, Any]:
        """The card as plain data."""
        return asdict(self)


def _check_facts(place: str, facts: Any, numbers: Sequence[str]) -> None:
    """That facts are a mapping in which these, where they are there, are finite numbers."""
    if not isinstance(facts, Mapping):
        raise ValueError(f"{place} is no mapping")
    for name in numbers:
        value = facts.get(name, 0)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= sys.float_info.max:
            raise ValueError(f"{place}.{name} = {str(value)[:40]!r} is no finite number")


def _check_examined(place: str, examined: Any) -> None:
    """That what was measured can be shown: of each row a mean, and the ends of its interval where they are there."""
    if not isinstance(examined, Mapping):
        raise ValueError(f"{place} is no mapping")
    for row, found in examined.items():
        if isinstance(found, Mapping) and "mean" in found:
            ends = [name for name in ("low", "high") if found.get(name) is not None]
            _check_facts(f"{place}.{row}", found, ("mean", *ends))
            if not isinstance(found.get("metric"), str):
                raise ValueError(f"{place}.{row}.metric is no text")


def read_card(path: Path) -> Card:
    """The card of a file. Its texts have lost characters that steer a terminal.

    Raises:
        DamagedFileError: it is no such card.
        OSError: it cannot be read.
    """
    document = read_entry(path, "card of a trained policy", REMEDY, MOST_BYTES)
    plain = printable(document.plain())
    try:
        if not set(plain) <= {entry.name for entry in fields(Card)}:
            raise ValueError("unknown entries")
        return Card(**{**plain, "actions": tuple(plain.get("actions", ()))})
    except (TypeError, ValueError) as error:
        raise document.source.error(error) from error
