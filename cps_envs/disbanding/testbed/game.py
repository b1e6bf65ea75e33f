"""The disbanding game on robots: the same moves and observations, another plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from gymnasium import spaces

from cps_envs.core.game import Game
from cps_envs.core.policy import RoleSpec
from cps_envs.core.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, Role
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.initial import place
from cps_envs.disbanding.metrics import METRICS as STRING_METRICS
from cps_envs.disbanding.observation import observe_attacker
from cps_envs.disbanding.state import State
from cps_envs.disbanding.state import allocate as allocate_string
from cps_envs.disbanding.testbed.config import RobotConfig
from cps_envs.disbanding.testbed.metrics import METRICS, measure_episode
from cps_envs.disbanding.testbed.observation import observe_robots
from cps_envs.disbanding.testbed.rules import rules_of
from cps_envs.disbanding.testbed.scene import Scene, scene_of
from cps_envs.disbanding.testbed.start import draw_episode, place_robots, string_parameters
from cps_envs.disbanding.testbed.state import Robots, allocate
from cps_envs.disbanding.testbed.team import RobotTeam
from cps_envs.disbanding.testbed.turn import Account, settle, take_turn


class RobotGame(Game):
    """A game step is a control period of the robots; the attacker decides at whole seconds from 1 s on.

    Roles, actions and observations are those of `DisbandingGame` under `config.road`: policies of the disbanding
    problem see a road, `config.scale` times as large as the circle, and what they see are the filters' estimates.

    Payoff: the increase of E_v (2.8) in percent over the robots that are not disbanded, inside its window.
    """

    name = "testbed"
    payoff_parts = ("velocity_error",)

    def __init__(self, config: RobotConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        road = config.road
        self.config: RobotConfig = config
        self.horizon, self.step_s = config.num_periods, config.control_period_s
        self.decision_interval = {"attacker": road.periods_per_second, "defender": 1}
        self.fields = {"attacker": attacker_fields(road), "defender": defender_fields(road)}
        self.action_space = {
            "attacker": spaces.Discrete(config.num_platoons + 1),
            "defender": spaces.Box(-1.0, 1.0, (config.num_robots,), np.float32),
        }
        self.neutral_action = {"attacker": np.array(0), "defender": np.zeros(config.num_robots)}
        self.max_correction_mps2 = road.max_acceleration_mps2 - road.min_acceleration_mps2
        self.rules = rules_of(config)
        self.robots: Robots = allocate(config, num_envs)
        self.string: State = allocate_string(num_envs, config.num_platoons, config.vehicles_per_platoon)
        self.parameters = np.stack([string_parameters(config)] * num_envs)
        self._headways = np.full((num_envs, config.num_robots), config.driver_headway_s)
        self._account = Account(
            table=np.zeros((num_envs, len(STRING_METRICS))),
            velocity_error=np.zeros(num_envs),
            budget=np.zeros(num_envs, np.int64),
            legal=np.zeros((num_envs, config.num_platoons + 1), np.bool_),
        )
        self._waiting = np.zeros(num_envs, np.int64)
        self._still = np.zeros((num_envs, config.num_robots))

    def spec(self, role: Role) -> RoleSpec:
        """The interface of a role of the disbanding problem, whose policies play here."""
        return replace(super().spec(role), problem="disbanding", config=self.config.road)

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        place(self.string, self.parameters, envs, driver_headways_s=self._headways)
        self._account.budget[envs] = self.config.road.max_budget
        for b in np.flatnonzero(envs).tolist():
            draw_episode(self.robots, b, self.config, generators[b])
            place_robots(self.robots, b, self.config, self.string.position[b] / self.config.scale)
            self.string.speed[b] = self.config.scale * self.robots.speed[b]
        settle(self.robots, self.string, self.parameters, self.rules, self._account)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        before = self._account.velocity_error.copy()
        targets = actions.get("attacker", self._waiting)
        correction = self.max_correction_mps2 * actions["defender"] if "defender" in actions else self._still
        moves = (targets, correction, envs, num_steps)
        take_turn(self.robots, self.string, self.parameters, *moves, self.rules, self._account)
        return self._account.velocity_error - before

    def observe(self, role: Role) -> Observation:
        """See `disbanding.fields`."""
        values = np.empty((self.num_envs, self.fields[role].size))
        if role == "attacker":
            account = self._account
            observe_attacker(self.string, self.parameters, account.table, account.budget, False, values)
        else:
            observe_robots(self.string, self.parameters, self._account.table, self.rules, values)
        return self.fields[role].encode(values)

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal attacks (B, N + 1); the defender's corrections are always legal."""
        return self._account.legal.copy() if role == "attacker" else None

    def team(self, role: Role) -> Team:
        """The defender as one agent per robot."""
        return RobotTeam(self) if role == "defender" else super().team(role)

    @property
    def intact(self) -> BoolArray:
        """The robots (B, M) of platoons never disbanded so far."""
        intact: BoolArray = np.repeat(np.isinf(self.string.disbanding_s), self.config.vehicles_per_platoon, axis=1)
        return intact

    def metrics(self) -> dict[str, Array]:
        """`metrics.METRICS` so far, each (B,)."""
        intact = self.intact
        rows = [
            measure_episode(self.robots, b, int(self.string.step[b]), intact[b], self.config)
            for b in range(self.num_envs)
        ]
        return dict(zip(METRICS, (self._account.velocity_error.copy(), *np.array(rows).T), strict=True))

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        return scene_of(self.robots, self.string, b, self.config, self.episode_metrics(b))
