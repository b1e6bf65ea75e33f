"""The rogue-vehicle game: B platoons, an attacker who drives one vehicle, a defender who drives the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces

from cps_envs.core.game import Game
from cps_envs.core.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.rogue.actions import command_limits, mode_space
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.episode import start
from cps_envs.rogue.fields import attacker_fields, defender_fields, watches_rear
from cps_envs.rogue.laws import COMMANDED
from cps_envs.rogue.metrics import METRICS, PAYOFF_PARTS, measure
from cps_envs.rogue.observation import observe_attacker, observe_defender
from cps_envs.rogue.rules import rules_of
from cps_envs.rogue.scene import Scene
from cps_envs.rogue.snapshot import scene_of
from cps_envs.rogue.state import State, allocate
from cps_envs.rogue.swarm import VehicleTeam
from cps_envs.rogue.turn import take_turn


class RogueGame(Game):
    """A game step is a control period of 0.1 s; the laws of the vehicles run inside it at every integration step.

    Attacker: Box (1,), from full braking effort (-1) over the effort that keeps the present speed (0) to full driving
    effort (1), set at each decision and held.
    Defender, `defense_action="mode"`: MultiDiscrete, for each intact vehicle from the rear its law (`laws.LAWS`) and
    whether following is modified: growing separation, authority (5.12). `"command"`: Box (n - 1,), accelerations.

    Payoff: the increase of the damage D (5.8), plus w times the increase of the formation cost. Nothing terminates.
    """

    name = "rogue"

    def __init__(self, config: RogueConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: RogueConfig = config
        self.horizon = round(config.duration_s / config.control_period_s)
        self.step_s = config.control_period_s
        self.decision_interval = {"attacker": round(config.attack_hold_s / config.control_period_s), "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        intact = config.num_intact
        self.modes = config.defense_action == "mode"
        defense = mode_space(intact) if self.modes else spaces.Box(-1.0, 1.0, (intact,), np.float32)
        self.action_space = {"attacker": spaces.Box(-1.0, 1.0, (1,), np.float32), "defender": defense}
        still = np.zeros(2 * intact, np.int64) if self.modes else np.zeros(intact)
        self.neutral_action = {"attacker": np.zeros(1), "defender": still}
        self.payoff_parts = PAYOFF_PARTS
        self.rules = rules_of(config)
        self._limits = command_limits(config)
        self._rear_watchers = watches_rear(config)
        self.state: State = allocate(num_envs, config.num_vehicles)
        self._table = np.zeros((num_envs, len(METRICS)))
        self._neutral = {role: np.stack([action] * num_envs) for role, action in self.neutral_action.items()}
        self._orders = np.full((num_envs, intact, 2), (COMMANDED, 0))
        self._accelerations = np.zeros((num_envs, intact))

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        for b in np.flatnonzero(envs).tolist():
            start(self.state, b, self.config, generators[b])
        measure(self.state, self.rules, self._table)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        before = self._paid()
        attack = actions.get("attacker", self._neutral["attacker"])
        orders, accelerations = self._moves(actions.get("defender", self._neutral["defender"]))
        take_turn(self.state, attack, orders, accelerations, envs, num_steps, self.rules, self._table)
        return self._paid() - before

    def _moves(self, action: Array) -> tuple[IntArray, FloatArray]:
        """Laws (B, n - 1, 2) and accelerations (B, n - 1) in m/s2 of the defender's action."""
        if self.modes:
            return action.reshape(self._orders.shape), self._accelerations
        braking, driving = self._limits
        return self._orders, np.where(action < 0.0, braking, driving) * action

    def _paid(self) -> FloatArray:
        """The attacker's payoff (B,) so far."""
        paid: FloatArray = self._table[:, 0] + self._table[:, 1]
        return paid

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        values = np.empty((self.num_envs, self.fields[role].size))
        if role == "attacker":
            observe_attacker(self.state, self.rules, values)
        else:
            observe_defender(self.state, self.rules, self._rear_watchers, self.modes, values)
        return self.fields[role].encode(values)

    def metrics(self) -> dict[str, Array]:
        """`metrics.METRICS` so far, each (B,)."""
        return dict(zip(METRICS, self._table.T, strict=True))

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(METRICS, self._table[b].tolist()))  # noqa: B905, strict costs a microsecond

    def model(self, b: int, num_envs: int) -> RogueGame:
        """Privileged: copies of one episode in its present state."""
        copy = RogueGame(self.config, num_envs)
        for mine, theirs in zip(self.state, copy.state, strict=True):
            theirs[:] = mine[b]
        copy.elapsed[:] = self.elapsed[b]
        copy._table[:] = self._table[b]
        return copy

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        return scene_of(self.state, b, self.config, self.episode_metrics(b))

    def team(self, role: Role) -> Team:
        """The defender as one agent per intact vehicle."""
        return VehicleTeam(self) if role == "defender" else super().team(role)
