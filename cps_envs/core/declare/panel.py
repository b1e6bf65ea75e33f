"""Panels: whom a role meets, as lists of contestants with weights.

A problem declares all of its panels in `<problem>/panels.py`: who plays in each preset, in training and in the
challenge. They are plain data: policies by reference, so that declaring them loads none.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from cps_envs.core.documents import typed
from cps_envs.core.types import Role

MIXTURE = "mixture"


@dataclass(frozen=True)
class Contestant:
    """A policy that takes part, with what is known of it beside its reference."""

    name: str
    policy: str = ""  # reference, as `cps-envs play` takes it; the name itself if empty
    title: str = ""  # in the tables, where the name does not say enough
    overrides: Mapping[str, Any] = field(default_factory=dict)  # of the venue where it plays, such as how it observes
    episodes: int = 0  # where they are not those of the table
    metric: str = ""  # what its row shows, where it is not that of the table
    weight: float = 1.0  # in its panel
    answer: str = ""  # the best reply known to it, which scores 100 in the challenge; may be told what its role infers

    @property
    def heading(self) -> str:
        """What the tables call it."""
        return self.title or self.name

    @property
    def reference(self) -> str:
        """The policy to look up."""
        return self.policy or self.name


Panel: TypeAlias = tuple[Contestant, ...]


def panel(members: Sequence[str] | Mapping[str, float]) -> Panel:
    """A panel of policies by reference, with weights where it is a mapping."""
    if isinstance(members, Mapping):
        return tuple(Contestant(each, weight=weight) for each, weight in members.items())
    return tuple(map(Contestant, members))


def mixed(members: Panel) -> str:
    """The reference that draws one of a panel for each episode, by weight; of a single member its own."""
    if len(members) == 1:
        return members[0].reference
    weights = [each.weight for each in members]
    alike = len(set(weights)) == 1
    return mixture([each.reference for each in members], None if alike else weights)


def references(presets: Mapping[str, Mapping[Role, Panel]]) -> dict[str, dict[Role, str]]:
    """The reference of each panel, by preset and role, as `Problem.opponents` has them."""
    return {preset: {role: mixed(members) for role, members in each.items()} for preset, each in presets.items()}


def mixture(policies: Sequence[str], weights: Sequence[float] | None = None) -> str:
    """The reference of a mixture, `mixture?policies=["a","b"]&weights=[1,3]`."""
    named = f"{MIXTURE}?policies={_quoted(list(policies))}"
    return named if weights is None else f"{named}&weights={_quoted([_plain(weight) for weight in weights])}"


def written(name: str, **options: Any) -> str:
    """A policy's reference with its options, such as "chi2?gate=0.01"."""
    pairs = (f"{key}={_word(value)}" for key, value in options.items())
    return f"{name}?{'&'.join(pairs)}" if options else name


def _stays_text(value: str) -> bool:
    """Whether it is read back as this text, and not as a number or an error."""
    try:
        return bool(typed(value) == value)
    except ValueError:  # NaN
        return False


def _word(value: Any) -> str:
    """A value as an option has it: a text without quotes where it is read back as the same text."""
    plain = isinstance(value, str) and not value.startswith(("[", "{", '"')) and _stays_text(value)
    return _encoded(value if plain else json.dumps(value))


def _plain(weight: float) -> float:
    return int(weight) if weight == int(weight) else weight


def _quoted(value: list[str] | list[float]) -> str:
    """JSON as the value of a query; what need not be encoded stays readable."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    return _encoded(text).replace("+", "%2B")


def _encoded(text: str) -> str:
    return text.replace("%", "%25").replace("&", "%26")
