"""Families of policies: one controller each, whose named numbers a search may choose."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_envs.core.compute.kernels import records
from cps_envs.core.errors import ConfigurationError, UnknownNameError, near
from cps_envs.core.game.play import play_episodes
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.policy import AnalyticPolicy, Policy, RoleSpec, ask, begins, begun
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, Role, State, other
from cps_envs.registration import PROBLEMS


@dataclass(frozen=True)
class Number:
    """A number of a family, and how a search moves it."""

    name: str
    start: float
    step: float  # how far it is worth moving: the unit of the search
    by_factors: bool = False  # moves by factors of exp(step), and keeps its sign


@dataclass(frozen=True)
class Family:
    """Policies of one role that differ in their numbers only.

    `build(spec, values)` makes a policy that plays episode b of a batch by row b of `values` (B, k), in the order of
    `numbers`.
    """

    problem: str
    role: Role
    numbers: tuple[Number, ...]
    build: Callable[[RoleSpec, FloatArray], Policy]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers, in order."""
        return tuple(number.name for number in self.numbers)

    def row(self, numbers: Mapping[str, float]) -> FloatArray:
        """One set of numbers (1, k), given by name; the others are the starts.

        Raises:
            ConfigurationError: the family has no number of such a name, or a value is no number.
        """
        for name, value in numbers.items():
            if name not in self.names:
                raise ConfigurationError(f"there is no number {name!r}. {near(name, self.names)}")
            if not isinstance(value, (int, float)):
                raise ConfigurationError(f"the option {name} = {value!r} must be a number")
        return np.array([[numbers.get(each.name, each.start) for each in self.numbers]], np.float64)

    def values(self, points: FloatArray) -> FloatArray:
        """The numbers (P, k) at points (P, k) of the search, whose origin is the start and whose unit is the step."""
        start, step = np.array([(number.start, number.step) for number in self.numbers]).T
        by_factors = np.array([number.by_factors for number in self.numbers])
        moved = points * step
        found: FloatArray = np.where(by_factors, start * np.exp(np.where(by_factors, moved, 0.0)), start + moved)
        return found


def as_records(numbers: Any, rows: FloatArray) -> Array:
    """Rows (B, k) of the numbers of a named tuple, or one row (k,), as records (B,) that kernels read by name."""
    rows = np.atleast_2d(np.asarray(rows, np.float64))
    table = records(numbers, len(rows))
    for name, column in zip(numbers._fields, rows.T, strict=True):
        table[name] = column
    return table


def play_family(
    family: Family, problem: Problem, config: Any, opponent: PolicyReference, values: FloatArray, seeds: Sequence[int]
) -> dict[str, Array]:
    """One episode per seed by the numbers in its row of `values` (B, k), see `core.game.play.play_episodes`."""
    policy = Members(problem.game(config, 1).spec(family.role), family, values)
    return play_episodes(problem, config, {family.role: policy, other(family.role): opponent}, seeds)


class Members(AnalyticPolicy):
    """Plays episode b of a match by row b of `values`, (B, k), also when other episodes have ended.

    With one row, (1, k), it plays every episode by it.
    """

    masked = True

    def __init__(self, spec: RoleSpec, family: Family, values: FloatArray) -> None:
        super().__init__(spec)
        self.family, self.sets = family, values
        self._rows = np.arange(len(values))
        self._policy = family.build(spec, values)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The row of each episode, and the state of the family's policy."""
        rows = np.arange(len(generators)) % len(self.sets)
        return (rows, *(begun(self._of(rows), generators, knowledge) or ()))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """What each episode's policy plays."""
        policy = self._of(state[0])
        actions, own = ask(policy, seen, state[1:] or (() if begins(policy) else None))
        return actions, (state[0], *(own or ()))

    def _of(self, rows: Array) -> Policy:
        """The policy of episodes with these rows (B,)."""
        if len(self.sets) > 1 and not np.array_equal(rows, self._rows):
            self._rows, self._policy = rows, self.family.build(self.spec, self.sets[rows])
        return self._policy


def families(problem: str) -> dict[str, Family]:
    """The families of a problem by name, such as rogue-escort: ESCORT in `families.py` of its package."""
    if problem not in PROBLEMS:
        return {}
    held = vars(importlib.import_module(f"cps_baselines.{problem}.families"))
    found = {name: each for name, each in held.items() if isinstance(each, Family)}
    return {f"{problem}-{name.lower().replace('_', '-')}": each for name, each in found.items()}


def find_family(reference: str) -> Family:
    """The family of a name such as "rogue-escort", or of `module:attribute`, which runs code and needs consent.

    Raises:
        UnknownNameError: there is none.
        UntrustedCodeError: `module:attribute` without consent, see `cps_envs.trust`.
    """
    module, colon, attribute = reference.partition(":")
    if not colon:
        known = families(reference.partition("-")[0])
        if reference not in known:
            every = [name for problem in PROBLEMS for name in families(problem)]
            raise UnknownNameError(f"there is no family of policies {reference!r}. {near(reference, every)}")
        return known[reference]
    require_trust(reference)
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(f"no family of policies can be imported from {reference!r}: {error}") from error
    if not isinstance(found, Family):
        raise UnknownNameError(f"{reference!r} is not a family of policies: it should be a cps_baselines.family.Family")
    return found
