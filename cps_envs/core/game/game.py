"""The game protocol: a batch of B episodes of a two-player zero-sum problem, stepped together."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, TypeAlias

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from cps_envs.core.compute.clock import count_late, restart, tick
from cps_envs.core.compute.threads import Threads
from cps_envs.core.declare.columns import ActionColumn, raw_columns
from cps_envs.core.declare.config import widened
from cps_envs.core.declare.fields import Fields
from cps_envs.core.declare.measures import Measure
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.game.objective import Objective, objective_of
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.inside import InsidePhysics
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Observation, Role

Adapters: TypeAlias = Mapping[Role, Mapping[str, Callable[[RoleSpec], Adapter]]]  # by name
UNKNOWN = 2**62  # more game steps than any horizon


class Game(ABC):
    """B environments of one problem. Moves are simultaneous; a role's action holds until its next decision.

    A subclass sets the attributes below in its constructor `(config, num_envs)` and implements the abstract methods.
    The clock is kept here: one call of `advance` moves the marked environments by whole game steps.
    """

    name: str  # of the problem
    config: Any  # frozen dataclass
    horizon: int  # game steps per episode
    step_s: float  # duration of a game step, s
    decision_interval: Mapping[Role, int]  # game steps between two decisions of a role
    fields: Mapping[Role, Fields]
    action_space: Mapping[Role, spaces.Space[Any]]  # of one environment
    neutral_action: Mapping[Role, Array]  # of one environment; changes nothing
    adapters: ClassVar[Adapters] = {}  # what learners play the roles through
    measures: ClassVar[Mapping[str, Measure]] = {}  # what the metrics say, see `measures_of`
    payoff_parts: tuple[str, ...]  # the metrics whose sum is the undiscounted return of the attacker, by its own payoff
    objective: Objective | None = None  # what the configuration pays instead, see `pay_as_configured`
    threaded: bool = False  # whether `_advance` calls its kernel through `self.threads.run`

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self.elapsed: IntArray = np.zeros(num_envs, np.int64)  # (B,) game steps done
        self.terminated: BoolArray = np.zeros(num_envs, np.bool_)  # (B,) ended by physics
        self.threads = Threads(1, num_envs)
        self._latest = UNKNOWN  # at least the largest entry of `elapsed`

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "config" and "config" in self.__dict__:
            raise AttributeError(
                f"the configuration of a game of {self.name!r} is what its arrays are made for, and read-only: build "
                "another game, or call configure(...) of an environment"
            )
        super().__setattr__(name, value)

    def reset(self, envs: BoolArray, generators: Generators, drawn: Any = None) -> None:
        """Start new episodes in the marked environments (B,), each drawing from its own of the B generators.

        They draw from the ranges of the configuration `drawn`, which has passed `check_draws`; None: the game's own.
        """
        restart(self.elapsed, self.terminated, envs)
        if drawn is None or drawn is self.config:
            self._reset(envs, generators)
        else:
            self._draw_from(drawn)
            try:
                self._reset(envs, generators)
            finally:
                self._draw_from(self.config)
        if self.objective is not None:
            self.objective.begin(envs)

    def check_draws(self, drawn: Any) -> None:
        """Check that episodes can draw from the ranges of `drawn`, which differs in nothing else.

        Raises:
            ConfigurationError: arrays or observations are not made for such values, or the game draws otherwise.
        """
        self._draw_from(drawn)
        self._draw_from(self.config)
        wide = widened(self.config, drawn)
        if wide is self.config:
            return
        make: Callable[[Any, int], Game] = type(self)
        if not self._is_made_like(make(wide, 1)):
            changed = [name for name, value in vars(wide).items() if value != getattr(self.config, name)]
            given = ", ".join(f"{name} = {shown(getattr(drawn, name))}" for name in changed)
            made = ", ".join(f"{name} = {shown(getattr(self.config, name))}" for name in changed)
            wanted = ", ".join(f"{name}={shown(getattr(wide, name))}" for name in changed)
            raise ConfigurationError(
                f"{given}: the arrays and observations of this environment are made for {made}. Make one with {wanted}"
            )

    def _is_made_like(self, other: Game) -> bool:
        """Whether the other game has equal spaces and observations, and arrays of equal shapes."""
        own, theirs = ([array.shape[1:] for array in game.parts()] for game in (self, other))
        spaces_of = (self.action_space, other.action_space)
        seen = all(tuple(self.fields[role]) == tuple(other.fields[role]) for role in self.fields)
        return own == theirs and seen and spaces_of[0] == spaces_of[1]

    def _draw_from(self, drawn: Any) -> None:
        """Let resets draw from the ranges of this configuration, of which only drawn quantities are others.

        Raises:
            ConfigurationError: the game draws in one way only, which is so where a subclass does not say otherwise.
        """
        if drawn is not self.config:
            raise ConfigurationError(f"episodes of {self.name!r} draw from the configuration that it is made with")

    def advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        """Move the marked environments by `num_steps` game steps under the roles' held actions (B, ...).

        A role that is missing from `actions` takes its neutral action. Returns the attacker's payoff (B,), zero for
        unmarked environments. An environment that terminates on the way stands still from there on; `elapsed` counts
        on, so an observed or measured time has to come from the game's own state.

        Raises:
            ResetNeeded: a marked environment that has not terminated would go beyond its horizon.
        """
        if self._latest + num_steps > self.horizon:
            self._check_end(envs, num_steps)
        if self.objective is None:
            payoff = self._advance(actions, envs, num_steps)
        else:
            payoff = self._paid(self.objective, actions, envs, num_steps)
        self._latest = tick(self.elapsed, envs, num_steps)
        return payoff

    def _paid(self, objective: Objective, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        """Advance, and pay what the configuration says; a function is asked at every game step."""
        stride, payoff = num_steps if objective.function is None else 1, np.zeros(self.num_envs)
        for _ in range(0, num_steps, stride):
            live = envs & ~self.terminated
            self._advance(actions, live, stride)
            payoff = payoff + objective.pay(self.metrics(), live)
        return payoff

    def pay_as_configured(self) -> None:
        """Count what the field `payoff` of the configuration says. A constructor whose problem has one ends with this.

        Raises:
            ConfigurationError: it names a metric that is not measured here, or no function.
            UnknownNameError: nothing can be imported from the text that names a function.
            UntrustedCodeError: that text names code that the user has not agreed to run.
        """
        self.objective = objective_of(self.config, self.metrics())

    @property
    def terms(self) -> tuple[tuple[str, float], ...]:
        """The metrics that make the return, and their weights. Empty if the objective is a function."""
        return tuple((part, 1.0) for part in self.payoff_parts) if self.objective is None else self.objective.weights

    def _check_end(self, envs: BoolArray, num_steps: int) -> None:
        if count_late(self.elapsed, self.terminated, envs, self.horizon - num_steps) > 0:
            late = envs & ~self.terminated & (self.elapsed + num_steps > self.horizon)
            listed = np.flatnonzero(late).tolist()
            raise ResetNeeded(
                f"environments {listed} cannot advance by {num_steps} game steps: an episode of {self.name!r} has "
                f"{self.horizon} and {self.elapsed[late].tolist()} are done. Reset them, or mark only the others"
            )

    def use_threads(self, num_threads: int) -> None:
        """Step the environments in so many threads, which changes no result.

        Raises:
            ConfigurationError: fewer than one, or more where the game runs in one only.
        """
        if num_threads < 1:
            raise ConfigurationError(f"num_threads = {num_threads} must be at least 1")
        if num_threads > 1 and not self.threaded:
            raise ConfigurationError(f"num_threads = {num_threads}: {self.name!r} runs in one thread; leave it out")
        self.threads = Threads(num_threads, self.num_envs)

    @abstractmethod
    def _reset(self, envs: BoolArray, generators: Generators) -> None: ...

    @abstractmethod
    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray: ...

    @abstractmethod
    def observe(self, role: Role) -> Observation:
        """A fresh array (B, fields[role].size) of encoded observations."""

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal actions (B, k) of a Discrete role, or of a MultiDiscrete one flattened; None where all are legal.

        A fresh array. While no decision of the role is due only the neutral action is legal.
        """
        return None

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """Legal actions (k,) of one environment as a fresh int8 array; None where all are legal."""
        mask = self.action_mask(role)
        return None if mask is None else mask[b].astype(np.int8)

    @abstractmethod
    def metrics(self) -> dict[str, Array]:
        """The problem's measures so far, each (B,)."""

    def episode_metrics(self, b: int) -> dict[str, Any]:
        """The measures of one environment as Python numbers, in a fresh dictionary."""
        return {name: values.item(b) for name, values in self.metrics().items()}

    def parts(self) -> tuple[Array, ...]:
        """All that environments consist of, each with an axis B first; nothing where a problem hands out no copies."""
        return ()

    def refresh(self) -> None:  # noqa: B027 - nothing follows in most games
        """Compute again what follows from the `parts`, after they have been copied."""

    def unplayed(self, num_envs: int) -> Game:
        """A game of this kind and configuration that has not begun, for copies."""
        make: Callable[[Any, int], Game] = type(self)
        return make(self.config, num_envs)

    def model(self, b: int, num_envs: int) -> Game:
        """Privileged: `num_envs` copies of one environment in its present state, to plan on.

        Raises:
            TypeError: the problem offers no such copy.
        """
        copy = self.unplayed(num_envs)
        for mine, theirs in zip(self._copied(), copy._copied(), strict=True):
            theirs[:] = mine[b]
        copy.refresh()
        return copy

    def fingerprint(self) -> bytes:
        """A digest of the `parts`; equal for games that will go on alike under equal actions."""
        return hashlib.sha256(b"".join(array.tobytes() for array in self.parts())).digest()

    def _copied(self) -> tuple[Array, ...]:
        parts = self.parts()
        if not parts:
            raise TypeError(f"the problem {self.name!r} hands no copies of its state to planners")
        paid = () if self.objective is None else (self.objective.before,)
        return (*parts, self.elapsed, self.terminated, *paid)

    def truth(self, b: int) -> Mapping[str, Any]:
        """Privileged: what roles have to infer of one environment, by name, for policies that declare it.

        Arrays may be views; policies get copies.

        Raises:
            TypeError: the problem has nothing privileged.
        """
        raise TypeError(f"the problem {self.name!r} tells no policy what an episode hides")

    def privileged(self, role: Role) -> Observation:
        """What an episode hides, (B, p) float32 of about unit size, for a learner's value function in training only.

        No policy may see it. Empty, (B, 0), where the problem offers none.
        """
        return np.zeros((self.num_envs, 0), np.float32)

    def inside(self) -> InsidePhysics:
        """The game as functions of one environment, with which a GPU plays it.

        Raises:
            ConfigurationError: it has none, or not in this configuration.
        """
        raise ConfigurationError(f'{self.name!r} does not play on a GPU: leave device = "cuda" out')

    def team(self, role: Role) -> Team:
        """The role as a team of agents.

        Raises:
            TypeError: the problem has no decentralised form of this role.
        """
        raise TypeError(f"the {role} of {self.name!r} has no decentralised form")

    def scene(self, b: int) -> Any:
        """What the problem's viewer draws of an environment."""
        raise TypeError(f"the problem {self.name!r} has no viewer")

    def columns(self, role: Role) -> tuple[ActionColumn, ...]:
        """The entries of a role's action as recordings name them, in units."""
        return raw_columns(self.action_space[role])

    def spec(self, role: Role) -> RoleSpec:
        """The public interface of a role, for policies."""
        return RoleSpec(
            problem=self.name,
            role=role,
            fields=self.fields[role],
            action_space=self.action_space[role],
            neutral_action=self.neutral_action[role],
            decision_interval_s=self.decision_interval[role] * self.step_s,
            config=self.config,
            columns=self.columns(role),
            adapters=self.adapters.get(role, {}),
        )
