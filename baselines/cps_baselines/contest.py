"""What `cps-envs contest` plays of a problem, as plain data; a problem declares its own in `<problem>/contest.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from cps_baselines.arena import Contestant

SELF_PLAY = "a mixture of policies like these; docs/league.md says what it reaches"


@dataclass(frozen=True)
class Search:
    """A policy with numbers in it, which are searched by CMA-ES."""

    name: str  # short, such as "tracker"
    policy: str  # a reference; it may have options of its own
    ranges: Mapping[str, tuple[float, float]]  # option -> lowest and highest value; the search starts in the middle
    start: Mapping[str, float] = field(default_factory=dict)  # of options that are better begun elsewhere


@dataclass(frozen=True)
class Side:
    """Who plays one role in a contest."""

    policies: tuple[Contestant, ...]  # every registered policy that can play, `none` (the neutral one) included
    constants: tuple[str, ...]  # policies that take one action: all there are, or a grid, such as "always?action=1"
    informed: tuple[Contestant, ...] = ()  # told what the role has to infer; others are compared with the first one
    searches: tuple[Search, ...] = ()  # together they share the budget of CPU time
    margin_informed: float = 0.0  # the best informed one has to be better than every other policy by this
    margin_neutral: float = 0.0  # the best policy has to be better than doing nothing by this
    left_out: Mapping[str, str] = field(default_factory=dict)  # registered policy -> why it does not play


@dataclass(frozen=True)
class Column:
    """A number beside the score that means would hide."""

    metric: str
    title: str
    over: Literal["mean", "median", "smallest", "share"] = "mean"  # the share of the episodes in which it is above 0
    form: str = "{:.2f}"
    against: str = ""  # only episodes against this attacker, such as `none`; all if empty


@dataclass(frozen=True)
class Constraint:
    """Defenders without a weight: how much harm each lets through, and whether it costs no more than a reference."""

    harm: Column  # a mean, over all attackers
    cost: Column  # a mean, over all attackers
    reference: str  # a defender; the others' costs are compared with its, episode by episode


@dataclass(frozen=True)
class Variant:
    """A configuration that the contest is played in."""

    name: str  # short, for file names
    title: str
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Contest:
    """Both sides, the configurations, and what is shown. The first variant is judged; the others are only played.

    A policy's score is what the attacker is paid (the metric `return`), the mean over the policies of the other side.
    """

    problem: str
    attackers: Side
    defenders: Side
    variants: tuple[Variant, ...]
    episodes: int = 100  # of each meeting, on the evaluation seeds 0, 1, ...
    search_episodes: int = 16  # of each candidate of a search
    win_tolerance: float = 0.0  # a defender has won who never pays more than this above the best value without attack
    columns: tuple[Column, ...] = ()
    constraint: Constraint | None = None
    notes: tuple[str, ...] = ()
