"""What there is to measure, and what the project promises about speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from cps_envs.core.game.problem import Problem
from tools.bench import interfaces, opponents, sizes
from tools.bench.row import Measurement, Row, Values, Yardsticks

CARTPOLES = {  # steps of the single form, in each preset, that may cost so many of a single CartPole at most
    "DisbandingAttack": 8.0,
    "DisbandingDefense": 3.0,
    "FdiAttack": 1.5,
    "FdiDefense": 1.5,
    "HvacAttack": 3.0,
    "HvacDefense": 3.0,
    "RogueAttack": 2.5,
    "RogueDefense": 2.5,
}
MACHINE = Yardsticks(cartpole_us=6.3, updates_per_s=6.5e9, divisions_per_s=3.1e9)  # that of docs/speed.md
DECISIONS_PER_S = {"DisbandingAttack": 1.2e4}  # this and what follows: on that machine
SINGLE_ADDS_US, VECTOR_ADDS_US = 10.0, 20.0  # what an interface may add to a decision of one environment
RESET_US = 20.0  # a seeded reset of each of 1,024 environments, ...
LONGER_RESET_US = {"hvac learning": 40.0}  # ... which draws noise and disturbances of a whole episode here
OPPONENT_TIMES = 4.0  # the cost of `none` that a usual opponent may have at 64 environments, if it is no solver


@dataclass(frozen=True)
class Target:
    """A promise and what was measured."""

    what: str
    measured: float
    bound: float
    at_least: bool = False  # else at most

    @property
    def met(self) -> bool:
        """Whether it is kept."""
        return self.measured >= self.bound if self.at_least else self.measured <= self.bound


def judge(rows: Sequence[Row], yardsticks: Sequence[Yardsticks] = ()) -> list[Target]:
    """The targets of everything that was measured; rates and microseconds follow the speed of this machine."""
    found = {(row.part, row.name): row.values for row in rows if row.values}
    known = yardsticks or [MACHINE]
    slower = min(each.cartpole_us for each in known) / MACHINE.cartpole_us
    faster = max(each.updates_per_s for each in known) / MACHINE.updates_per_s  # compiled loops
    sizes_and_single = (*_sizes(found, faster), *_single(found, slower))
    return [*sizes_and_single, *_resets(found, slower), *_added(rows, slower), *_opponents(rows)]


Found: TypeAlias = Mapping[tuple[str, str], Values]


def _sizes(found: Found, faster: float) -> Iterator[Target]:
    for size in sizes.SIZES:
        name = f"{size.problem} {size.name}"
        values, than = found.get((sizes.PART, name)), found.get((sizes.PART, f"{size.problem} {size.cheaper[0]}"))
        if values is None:
            continue
        if size.per_s:
            yield Target(f"{name}: substeps/s", values["work_per_s"], size.per_s * faster, at_least=True)
        if size.reached:
            yield Target(f"{name}: of its limit", values["reached"], size.reached, at_least=True)
        if than is not None:
            cost = values["step_us"] / than["step_us"]
            yield Target(f"{name}: cost over {size.cheaper[0]}", cost, size.cheaper[1])


def _single(found: Found, slower: float) -> Iterator[Target]:
    for (part, name), values in found.items():
        env, _, form = name.partition(" ")
        if part != interfaces.PART or not form.endswith(" single"):
            continue
        if env in DECISIONS_PER_S:
            yield Target(f"{name}: decisions/s", values["steps_per_s"], DECISIONS_PER_S[env] / slower, at_least=True)
        if env in CARTPOLES:
            yield Target(f"{name}: CartPoles", values["cartpoles"], CARTPOLES[env])


def _resets(found: Found, slower: float) -> Iterator[Target]:
    for (part, name), values in found.items():
        if part == interfaces.RESETS:
            bound = LONGER_RESET_US.get(name, RESET_US) * slower
            yield Target(f"{name}: us of a reset", values["reset_us"], bound)


def _added(rows: Sequence[Row], slower: float) -> Iterator[Target]:
    for row in rows:
        if row.part == interfaces.ADDED:
            yield Target(f"{row.name}: us that single adds", row.values["single_us"], SINGLE_ADDS_US * slower)
            yield Target(f"{row.name}: us that vector adds", row.values["vector_us"], VECTOR_ADDS_US * slower)


def _opponents(rows: Sequence[Row]) -> Iterator[Target]:
    """The costliest usual opponent of each role that is no solver."""
    key = f"times_none_{opponents.NUM_ENVS[-1]}"
    worst: dict[str, Row] = {}
    for row in rows:
        usual = row.part == opponents.PART and opponents.USUAL in row.name
        if usual and key in row.values and row.note != opponents.SOLVER:
            role = " ".join(row.name.split(".")[:2])
            if role not in worst or row.values[key] > worst[role].values[key]:
                worst[role] = row
    for role, row in worst.items():
        policy = row.name.split(".", 2)[2]
        yield Target(f"{role}, costliest: {policy}, x none", row.values[key], OPPONENT_TIMES)


MAKERS: Mapping[str, Callable[[list[Problem]], Iterator[Measurement]]] = {
    sizes.PART: sizes.items,
    interfaces.PART: interfaces.items,
    interfaces.RESETS: interfaces.reset_items,
    interfaces.ADDED: interfaces.added_items,
    opponents.PART: opponents.items,
}


def plan(problems: Sequence[Problem], parts: Sequence[str]) -> list[Measurement]:
    """What there is to be measured of some problems in some of the parts."""
    return [item for part, make in MAKERS.items() if part in parts for item in make(list(problems))]
