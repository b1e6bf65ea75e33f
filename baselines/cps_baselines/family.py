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
from cps_envs.core.policies.mixture import Mixture
from cps_envs.core.policies.policy import AnalyticPolicy, Policy, RoleSpec, ask, begins, begun
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, Role, State, other
from cps_envs.registration import PROBLEMS

SPREAD = 0.75  # of its range: the step of a number with bounds


@dataclass(frozen=True)
class Number:
    """A number of a family, and how a search moves it."""

    name: str
    start: float
    step: float  # how far it is worth moving: the unit of the search
    by_factors: bool = False  # moves by factors of exp(step), and keeps its sign
    low: float = -np.inf  # a search goes no lower, and no higher than the next
    high: float = np.inf


def between(ranges: Mapping[str, tuple[float, float]], **start: float) -> tuple[Number, ...]:
    """Numbers within bounds, each name with its lowest and highest value; they start in the middle, or as given."""
    return tuple(
        Number(name, start.get(name, (low + high) / 2), SPREAD * (high - low), low=low, high=high)
        for name, (low, high) in ranges.items()
    )


@dataclass(frozen=True)
class Family:
    """Policies of one role that differ in their numbers only: the options of a policy.

    `builder(spec, values)` makes a policy that plays episode b of a batch by row b of `values` (B, k), in the order of
    `numbers`. Without one, each row is a policy of its own, which takes longer.
    """

    problem: str  # name, or module:attribute of a problem of your own
    role: Role
    policy: str  # reference; it may have options of its own
    numbers: tuple[Number, ...]
    builder: Callable[[RoleSpec, FloatArray], Policy] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers, in order."""
        return tuple(number.name for number in self.numbers)

    @property
    def is_bounded(self) -> bool:
        """Whether every number has bounds, between which a search can begin anywhere."""
        return all(np.isfinite([number.low, number.high]).all() for number in self.numbers)

    def build(self, spec: RoleSpec, values: FloatArray) -> Policy:
        """A policy that plays episode b of a batch by row b of `values` (B, k)."""
        if self.builder is None:
            return Several(spec, self, values)
        return self.builder(spec, values)

    def reference(self, values: FloatArray) -> str:
        """The policy with these numbers (k,), as every command takes it."""
        options = "&".join(f"{name}={value!r}" for name, value in zip(self.names, values.tolist(), strict=True))
        return f"{self.policy}{'&' if '?' in self.policy else '?'}{options}" if options else self.policy

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
        start, step, low, high = self._columns()
        by_factors = np.array([number.by_factors for number in self.numbers], np.bool_)
        moved = points * step
        found = np.where(by_factors, start * np.exp(np.where(by_factors, moved, 0.0)), start + moved)
        clipped: FloatArray = found.clip(low, high)
        return clipped

    def points(self, values: FloatArray) -> FloatArray:
        """Where in the search numbers (P, k) lie; infinite ones stay infinite."""
        start, step, _, _ = self._columns()
        by_factors = np.array([number.by_factors for number in self.numbers], np.bool_)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.log(np.maximum(values / start, 0.0))
        found: FloatArray = np.where(by_factors, shares, values - start) / step
        return found

    def _columns(self) -> FloatArray:
        """Starts, steps and bounds, (4, k)."""
        numbers = [(number.start, number.step, number.low, number.high) for number in self.numbers]
        return np.array(numbers, np.float64).reshape(-1, 4).T


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
    spec = problem.game(config, 1).spec(family.role)
    policy = Several(spec, family, values) if family.builder is None else Members(spec, family, values)
    return play_episodes(problem, config, {family.role: policy, other(family.role): opponent}, seeds)


class Several(Mixture):
    """Plays episode b by row b of `values`, (B, k), with a policy of its own for each set of numbers."""

    def __init__(self, spec: RoleSpec, family: Family, values: FloatArray) -> None:
        sets, places = np.unique(values, axis=0, return_inverse=True)
        super().__init__(spec, [family.reference(row) for row in sets])
        self._rows = places.ravel()

    def draw(self, generators: Generators) -> Array:
        """Nothing is drawn: each episode has its row."""
        drawn: Array = self._rows[np.arange(len(generators)) % len(self._rows)]
        return drawn


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
    """The families of a problem by name, such as rogue-escort: ESCORT in `families.py` of its package.

    Those of a problem of your own, `module:attribute`, lie in its module, and are called `module:ESCORT`.
    """
    module, colon, _ = problem.partition(":")
    if not colon and problem not in PROBLEMS:
        return {}
    held = vars(importlib.import_module(module if colon else f"cps_baselines.{problem}.families"))
    mine = {name: each for name, each in held.items() if isinstance(each, Family) and each.problem == problem}
    if colon:
        return {f"{module}:{name}": each for name, each in mine.items()}
    return {f"{problem}-{name.lower().replace('_', '-')}": each for name, each in mine.items()}


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
