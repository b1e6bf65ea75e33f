"""The disbanding game: B strings of platoons, an attacker who disbands, a defender who corrects."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces

from cps_envs.core.game import Game
from cps_envs.core.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, Role
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.episode import draw_episode
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.initial import place
from cps_envs.disbanding.metrics import METRICS
from cps_envs.disbanding.observation import observe_attacker, observe_defender
from cps_envs.disbanding.parameters import PARAMETERS
from cps_envs.disbanding.payoff import CHARGES, Rules
from cps_envs.disbanding.scene import Scene
from cps_envs.disbanding.state import State, allocate
from cps_envs.disbanding.swarm import VehicleTeam
from cps_envs.disbanding.turn import Account, settle, take_turn

MEASURES = METRICS + CHARGES


class DisbandingGame(Game):
    """A game step is a control period; the attacker decides at whole seconds from 1 s on, the defender every period.

    Attacker: Discrete(N + 1), 0 = wait, i = disband the paper's platoon i (1 = rear). Illegal choices mean waiting.
    Defender: Box (M,) front to rear, or (N,) with row i - 1 for platoon i; times u_max - u_min it is the correction of
    the commanded acceleration, held for the period and without effect on vehicles that are not mitigable.

    Payoff: the increase of E_v (2.8) in percent, plus the collision penalty and the charge of an early end.
    """

    name = "disbanding"

    def __init__(self, config: DisbandingConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: DisbandingConfig = config
        self.horizon = round(config.duration_s / config.control_period_s)
        self.step_s = config.control_period_s
        self.decision_interval = {"attacker": config.periods_per_second, "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        per_platoon = config.defense_action == "platoon"
        corrections = config.max_platoons if per_platoon else config.max_vehicles
        self.action_space = {
            "attacker": spaces.Discrete(config.max_platoons + 1),
            "defender": spaces.Box(-1.0, 1.0, (corrections,), np.float32),
        }
        self.neutral_action = {"attacker": np.array(0), "defender": np.zeros(corrections)}
        self.max_correction_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        paid = "velocity_error_all" if config.payoff_set == "all" else "velocity_error_intact_now"
        self._rules = Rules(
            horizon_steps=config.horizon_steps,
            collision_penalty=config.collision_penalty,
            velocity_error=METRICS.index(paid),
            steps_per_decision=config.periods_per_second * config.steps_per_period,
        )
        self.payoff_parts = (paid, "collision_penalty", "end_charge")
        self._allocate()

    def _allocate(self) -> None:
        config, envs = self.config, self.num_envs
        self.state: State = allocate(envs, config.max_platoons, config.vehicles_per_platoon)
        self.parameters = np.zeros(envs, PARAMETERS)
        self.budget = np.zeros(envs, np.int64)
        self._account = Account(
            table=np.zeros((envs, len(MEASURES))),
            total=np.zeros(envs),
            legal=np.zeros((envs, config.max_platoons + 1), np.bool_),
        )
        self._waiting = np.zeros(envs, np.int64)
        self._still = np.zeros((envs, config.max_vehicles))

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        shape = (self.num_envs, self.config.max_vehicles)
        factors, offsets, delays, headways = (np.zeros(shape) for _ in range(4))
        for b in np.flatnonzero(envs).tolist():
            episode = draw_episode(self.config, generators[b])
            self.parameters[b], self.budget[b] = episode.parameters, episode.budget
            factors[b], offsets[b] = episode.gap_factors, episode.speed_offsets_mps
            delays[b], headways[b] = episode.takeover_delays_s, episode.driver_headways_s
        place(
            self.state,
            self.parameters,
            envs,
            gap_factors=factors,
            speed_offsets_mps=offsets,
            takeover_delays_s=delays,
            driver_headways_s=headways,
        )
        self._settle()

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        targets = actions.get("attacker", self._waiting)
        correction = self._correction(actions["defender"]) if "defender" in actions else self._still
        before, steps = self._account.total.copy(), num_steps * self.config.steps_per_period
        moves = (self.budget, targets, correction, envs, steps)
        take_turn(self.state, self.parameters, *moves, self._rules, self._account)
        if self.config.on_collision == "end":
            self.terminated |= self.state.collided_intact.any(axis=1)
        return self._account.total - before

    def _correction(self, action: Array) -> FloatArray:
        """Corrections (B, M) in m/s2 of an action (B, M), or (B, N) in the per-platoon form."""
        correction: FloatArray = self.max_correction_mps2 * action
        if self.config.defense_action == "platoon":
            return self.by_vehicle(correction)
        return correction

    def by_vehicle(self, rows: FloatArray) -> FloatArray:
        """Values (B, M) of each vehicle from values (B, N) of the paper's platoons (row i - 1 = platoon i)."""
        size = self.config.vehicles_per_platoon
        present = self.parameters["num_vehicles"] // size
        row = present[:, np.newaxis] - 1 - np.arange(self.config.max_platoons)
        return np.repeat(np.take_along_axis(rows, np.maximum(row, 0), axis=1), size, axis=1)

    def _settle(self) -> None:
        settle(self.state, self.parameters, self.budget, self._rules, self._account)

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        values = np.empty((self.num_envs, self.fields[role].size))
        drawn = isinstance(self.config.num_platoons, tuple)
        if role == "attacker":
            observe_attacker(self.state, self.parameters, self._account.table, self.budget, drawn, values)
        else:
            observe_defender(self.state, self.parameters, self._account.table, drawn, values)
        return self.fields[role].encode(values)

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal attacks (B, N + 1); the defender's corrections are always legal."""
        return self._account.legal.copy() if role == "attacker" else None

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """Legal attacks (N + 1,) of one episode as int8."""
        return self._account.legal[b].astype(np.int8) if role == "attacker" else None

    def metrics(self) -> dict[str, Array]:
        """`metrics.METRICS` and `payoff.CHARGES` so far, each (B,)."""
        return dict(zip(MEASURES, self._account.table.T, strict=True))

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(MEASURES, self._account.table[b].tolist()))  # noqa: B905, strict costs a microsecond

    def model(self, b: int, num_envs: int) -> DisbandingGame:
        """Privileged: copies of one episode in its present state."""
        copy = DisbandingGame(self.config, num_envs)
        for mine, theirs in zip(self.state, copy.state, strict=True):
            theirs[:] = mine[b]
        copy.parameters[:] = self.parameters[b]
        copy.budget[:] = self.budget[b]
        copy.elapsed[:], copy.terminated[:] = self.elapsed[b], self.terminated[b]
        copy._settle()
        return copy

    def fingerprint(self) -> bytes:
        """A digest of parameters and state; equal for games that will go on alike under equal actions."""
        digest = hashlib.sha256(self.parameters.tobytes() + self.budget.tobytes())
        for array in self.state:
            digest.update(array.tobytes())
        return digest.digest()

    def num_present_platoons(self, b: int) -> int:
        """N of an episode, where it is drawn."""
        return int(self.parameters["num_vehicles"][b]) // self.config.vehicles_per_platoon

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        p = self.parameters[b]
        present = slice(0, int(p["num_vehicles"]))
        state = self.state
        return Scene(
            time_s=float(state.step[b] * p["dt_s"]),
            duration_s=self.config.duration_s,
            vehicles_per_platoon=self.config.vehicles_per_platoon,
            position=state.position[b, present].copy(),
            speed=state.speed[b, present].copy(),
            max_speed_mps=self.config.max_speed_mps,
            disbanding_s=state.disbanding_s[b, : present.stop // self.config.vehicles_per_platoon].copy(),
            collided=state.collided[b, present].copy(),
            metrics=self.episode_metrics(b),
        )

    def team(self, role: Role) -> Team:
        """The defender as one agent per vehicle."""
        return VehicleTeam(self) if role == "defender" else super().team(role)
