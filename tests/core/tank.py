"""A toy that is simple enough to be computed again by hand: four pumps keep a tank from running over.

It has what the other toy lacks: members of a team who are not paid alike and see unlike things, pumps that pause, a
legal action less for some, an adapter that remembers and one that waits, and episodes that end at times of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.config import Range, bounds, quantity, validate
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.declare.objective import objective
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, Role, State

PUMPS = 4
STEP_S = 0.5
FULL, HIGH = 6.0, 5.0  # levels at which the tank runs over, and from which on pumps may not add to it
GAIN, PRICE = 0.1, 0.01  # of a pump for a game step
DUE = {"attacker": 3, "defender": 2}  # game steps
NAMES = tuple(f"pump_{i}" for i in range(PUMPS))


@dataclass(frozen=True)
class TankConfig:
    steps: int = quantity(24, low=6, high=600, source="chosen; game steps")
    inflow: Range = quantity((0.1, 0.6), unit="m", low=0, high=2, source="chosen", ranged=True)
    leak: float = quantity(0.0, unit="m", low=0, high=1, source="chosen")
    payoff: Any = objective({"own": {}, "wet": {"rise": 2.0}}, source="chosen")

    def __post_init__(self) -> None:
        validate(self)


def fields_of(config: TankConfig) -> Fields:
    return Fields(Field("level", "m", -10, 10), Field("time_s", "s", 0, config.steps * STEP_S))


class Pumps(Adapter):
    """An agent for each pump: 0 pumps out, 1 rests, 2 pumps in. It remembers how often it has acted."""

    local = masked = pauses = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents, self.fields = NAMES, Fields(Field("level", "m", -10, 10), Field("acts", "-", 0, 100))
        self.action_space, self.neutral_action = spaces.Discrete(3), np.int64(1)

    def begin(self, num_envs: int) -> State:
        return (np.zeros(num_envs, np.int64),)

    def observe(self, seen: Seen, state: State) -> Observation:
        assert seen.team is not None
        acts = np.repeat(state[0][:, np.newaxis, np.newaxis] / 50 - 1, PUMPS, axis=1)
        return np.concatenate([seen.team, acts], axis=2, dtype=np.float32)

    def active(self, seen: Seen, state: State) -> BoolArray:
        return seen["level"][:, np.newaxis] <= 3.0 + 0.5 * np.arange(PUMPS)

    def masks(self, seen: Seen, state: State) -> BoolArray | None:
        assert seen.masks is not None
        return seen.masks.reshape(-1, PUMPS, 3)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return actions, (state[0] + 1,)


class Pairs(Adapter):
    """Two agents with two pumps each, which do the same: out at -1, in at 1."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents, self.fields = ("left", "right"), Fields(Field("level", "m", -10, 10))
        self.action_space, self.neutral_action = spaces.Box(-1.0, 1.0, (1,), np.float32), np.zeros(1)

    def observe(self, seen: Seen, state: State) -> Observation:
        return np.repeat(seen.observation[:, np.newaxis, :1], 2, axis=1)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return np.rint(np.repeat(actions[:, :, 0], 2, axis=1)).astype(np.int64) + 1, state


class Valve(Adapter):
    """The attacker decides again when the level has passed a whole metre."""

    masked = waits = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents, self.fields = ("valve",), fields_of(spec.config)
        self.action_space, self.neutral_action = spec.action_space, spec.neutral_action

    def begin(self, num_envs: int) -> State:
        return (np.full(num_envs, -100.0),)

    def observe(self, seen: Seen, state: State) -> Observation:
        return seen.observation[:, np.newaxis].copy()

    def due(self, seen: Seen, state: State) -> BoolArray:
        marks: BoolArray = np.floor(seen["level"]) != state[0]
        return marks

    def masks(self, seen: Seen, state: State) -> BoolArray | None:
        assert seen.masks is not None
        return seen.masks[:, np.newaxis]

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return actions[:, 0], (np.floor(seen["level"]),)


class Crew(Team):
    """Pump i sees the level 0.1 i too high, and pays a part of the rise and its own energy."""

    agents = NAMES

    def __init__(self, game: TankGame) -> None:
        self._game, self._charged, self._number = game, np.zeros_like(game.own), game.number.copy()

    def observe(self) -> Observation:
        seen = (self._game.level[:, np.newaxis] + 0.1 * np.arange(PUMPS)) / 10
        return seen[:, :, np.newaxis].astype(np.float32)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Since the last call in this episode."""
        same = (self._game.number == self._number)[:, np.newaxis]
        paid: FloatArray = self._game.own - np.where(same, self._charged, 0.0)
        self._charged, self._number = self._game.own.copy(), self._game.number.copy()
        return -paid

    def privileged(self) -> Observation:
        inflow = np.repeat(self._game.inflow[:, np.newaxis], PUMPS, axis=1)
        return np.stack([inflow, inflow * np.arange(PUMPS)], axis=2).astype(np.float32)


class TankGame(Game):
    """Steps of 0.5 s; payoff: the rise of the level, and what the pumps have used."""

    name = "tank"
    adapters: Any = {"defender": {"pump": Pumps, "pair": Pairs}, "attacker": {"valve": Valve}}

    def __init__(self, config: TankConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config, self.horizon, self.step_s, self.decision_interval = config, config.steps, STEP_S, DUE
        self.fields = {"attacker": fields_of(config), "defender": fields_of(config)}
        self.action_space = {"attacker": spaces.Discrete(3), "defender": spaces.MultiDiscrete([3] * PUMPS)}
        self.neutral_action = {"attacker": np.int64(0), "defender": np.ones(PUMPS, np.int64)}
        self.payoff_parts = ("rise", "energy")
        self.level, self.inflow, self.start = np.zeros(num_envs), np.zeros(num_envs), np.zeros(num_envs)
        self.energy, self.own = np.zeros(num_envs), np.zeros((num_envs, PUMPS))
        self.steps, self.number = np.zeros(num_envs, np.int64), np.zeros(num_envs, np.int64)
        self._draw_from(config)
        self.pay_as_configured()

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        for b in np.flatnonzero(envs):
            self.level[b] = self.start[b] = generators[b].uniform(1, 3)
            self.inflow[b] = generators[b].uniform(*self.drawn)
            self.energy[b] = self.steps[b] = self.own[b] = 0
            self.number[b] += 1

    def _draw_from(self, drawn: TankConfig) -> None:
        self.drawn = bounds(drawn.inflow)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        valves = actions.get("attacker", np.zeros(self.num_envs, np.int64))
        pushes = actions.get("defender", np.ones((self.num_envs, PUMPS))) - 1.0
        paid = np.zeros(self.num_envs)
        for _ in range(num_steps):
            for b in np.flatnonzero(envs & ~self.terminated):
                rise = self.inflow[b] * valves[b] + GAIN * pushes[b].sum() - self.config.leak
                used = PRICE * np.arange(1, PUMPS + 1) * pushes[b] ** 2
                self.level[b] += rise
                self.energy[b] += used.sum()
                self.steps[b] += 1
                self.own[b] += rise / PUMPS + used
                paid[b] += rise + used.sum()
                self.terminated[b] = self.level[b] >= FULL
        return paid

    def observe(self, role: Role) -> Observation:
        return self.fields[role].encode(np.column_stack([self.level, self.steps * STEP_S]))

    def action_mask(self, role: Role) -> BoolArray | None:
        """The valve opens wide up to a level only; pump 3 never pumps out, and none pumps in from a level on."""
        if role == "defender":
            legal = np.ones((self.num_envs, PUMPS, 3), np.bool_)
            legal[:, :, 2], legal[:, 3, 0] = (self.level <= HIGH)[:, np.newaxis], False
            return legal.reshape(self.num_envs, -1)
        due = self.elapsed % DUE[role] == 0
        return np.stack([np.ones_like(due), due, due & (self.level <= HIGH)], axis=1)

    def metrics(self) -> dict[str, Array]:
        return {"rise": self.level - self.start, "energy": self.energy, "level_m": self.level}

    def privileged(self, role: Role) -> Observation:
        return np.stack([self.inflow, self.inflow**2], axis=1).astype(np.float32)

    def team(self, role: Role) -> Team:
        return Crew(self) if role == "defender" else super().team(role)


NOBODY = "cps_envs.core.policies.policy:Idle"
OPENED = "always?action=1"
TANK = Problem(
    name="tank",
    version=0,
    summary="Pumps and a valve.",
    presets={"learning": TankConfig()},
    game=TankGame,
    fields={"attacker": fields_of, "defender": fields_of},
    opponents={"learning": {"attacker": OPENED, "defender": NOBODY}},
    swarm={"defender": "pump"},
    cost="energy",
    cost_limit=1.0,
    namespace="tanks",
)
