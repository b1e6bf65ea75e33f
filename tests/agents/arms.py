"""A problem that a learner solves in a second: two arms follow the cues that they see, and two dials do not move.

Arm a is paid 1 where it plays its cue plus 1. Its action 0 does nothing, and the other one is illegal for arm 0 now and
then. Arm 1 is active in the first half only. The dials are charged for the square of their distance to 0.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.config import quantity, validate
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.declare.training import Training
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, Role, State


@dataclass(frozen=True)
class ArmsConfig:
    duration_s: float = quantity(10.0, unit="s", low=1, high=600, source="chosen")
    dial_weight: float = quantity(1.0, low=0, high=10, source="chosen")

    def __post_init__(self) -> None:
        validate(self)


def arms_fields(config: ArmsConfig) -> Fields:
    return Fields(Field("cue", "", 0, 1, (2,), "what each arm should do"), Field("time_s", "s", 0, config.duration_s))


class ArmsGame(Game):
    name = "arms"

    def __init__(self, config: ArmsConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config, self.horizon, self.step_s = config, round(config.duration_s), 1.0
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": arms_fields(config), "defender": arms_fields(config)}
        self.action_space = {
            "attacker": spaces.MultiDiscrete([3, 3]),
            "defender": spaces.Box(-1.0, 1.0, (2,), np.float32),
        }
        self.neutral_action = {"attacker": np.zeros(2, np.int64), "defender": np.zeros(2)}
        self.payoff_parts = ("hits", "dials")
        self.cue, self.steps = np.zeros((num_envs, 2)), np.zeros(num_envs)
        self.hits, self.dials = np.zeros((2, num_envs))
        self.own = np.zeros((num_envs, 2)), np.zeros((num_envs, 2))
        self.generators: list[Any] = [None] * num_envs

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        for b in np.flatnonzero(envs):
            self.generators[b] = generators[b]
            self.cue[b] = generators[b].integers(0, 2, 2)
        for array in (self.steps, self.hits, self.dials):
            array[envs] = 0

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        arms = actions.get("attacker", np.zeros((self.num_envs, 2)))
        dials = actions.get("defender", np.zeros((self.num_envs, 2)))
        paid = np.where(envs[:, np.newaxis], arms == self.cue + 1, 0.0) * num_steps
        charged = np.where(envs[:, np.newaxis], (dials - 0.5) ** 2, 0.0) * self.config.dial_weight * num_steps
        self.own = paid, charged
        self.hits += paid.sum(axis=1)
        self.dials += charged.sum(axis=1)
        for b in np.flatnonzero(envs):
            self.steps[b] += num_steps
            self.cue[b] = self.generators[b].integers(0, 2, 2)
        return np.asarray((paid + charged).sum(axis=1))

    def observe(self, role: Role) -> Observation:
        return self.fields[role].encode(np.column_stack([self.cue, self.steps]))

    def action_mask(self, role: Role) -> BoolArray | None:
        if role == "defender":
            return None
        mask = np.ones((self.num_envs, 6), np.bool_)
        mask[:, 1] = (self.cue[:, 0] == 0) | (self.steps % 2 == 0)
        mask[:, 2] = (self.cue[:, 0] == 1) | (self.steps % 2 == 0)
        return mask

    def metrics(self) -> dict[str, Array]:
        return {"hits": self.hits, "dials": self.dials}

    def privileged(self, role: Role) -> Observation:
        return self.cue[:, :1].astype(np.float32)

    def team(self, role: Role) -> Team:
        return Parts(self, role)


class Parts(Team):
    """One agent per arm, or per dial."""

    def __init__(self, game: ArmsGame, role: Role) -> None:
        self._game, self._role = game, role
        self.agents = ("first", "second")

    def privileged(self) -> Observation:
        return self._game.cue[:, :, np.newaxis].astype(np.float32)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        paid, charged = self._game.own
        return paid + charged if self._role == "attacker" else -paid - charged


class Arms(Adapter):
    """One agent per arm, which sees its own cue."""

    masked = True
    agents = ("first", "second")

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.fields = Fields(Field("cue", "", 0, 1), Field("time_s", "s", 0, spec.config.duration_s))
        self.action_space, self.neutral_action = spaces.Discrete(3), np.int64(0)

    def observe(self, seen: Seen, state: State) -> Observation:
        time_s = np.repeat(np.reshape(seen["time_s"], (-1, 1)), 2, axis=1)
        values = np.stack([seen["cue"], time_s], axis=2)
        return self.fields.encode(values.reshape(-1, 2)).reshape(values.shape)

    def active(self, seen: Seen, state: State) -> BoolArray:
        first_half = np.ravel(seen["time_s"]) < self.spec.config.duration_s / 2
        return np.column_stack([np.ones(len(seen), np.bool_), first_half])

    def masks(self, seen: Seen, state: State) -> BoolArray | None:
        return None if seen.masks is None else seen.masks.reshape(-1, 2, 3)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return actions, state


class Dials(Arms):
    """One agent per dial."""

    masked = False

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.action_space, self.neutral_action = spaces.Box(-1.0, 1.0, (1,), np.float32), np.zeros(1)

    def active(self, seen: Seen, state: State) -> BoolArray:
        return np.ones((len(seen), 2), np.bool_)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return actions[..., 0], state


ArmsGame.adapters = {"attacker": {"arms": Arms}, "defender": {"dials": Dials}}
ARMS = Problem(
    name="arms",
    version=0,
    summary="Arms and dials.",
    presets={"paper": ArmsConfig(), "learning": ArmsConfig()},
    game=ArmsGame,
    fields={"attacker": arms_fields, "defender": arms_fields},
    opponents={
        preset: {"attacker": "cps_envs.core.policies.policy:Idle", "defender": "cps_envs.core.policies.policy:Idle"}
        for preset in ("paper", "learning")
    },
    viewer="",
    namespace="arms",
    training={
        "attacker": Training(
            adapter="arms", num_envs=32, ppo={"learning_rate": 1e-2, "n_steps": 10, "batch_size": 256}
        ),
        "defender": Training(adapter="dials", num_envs=32, ppo={"learning_rate": 5e-3, "n_steps": 10}),
    },
)
