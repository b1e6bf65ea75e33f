"""The disbanding game on robots: the same moves and observations, another plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, pack, records, unpack, view
from cps_envs.core.game.game import Game
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Observation, Role
from cps_envs.disbanding.attack import disband, mark_legal
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.observation import observe_attacker
from cps_envs.disbanding.payoff import Metrics, measure
from cps_envs.disbanding.start import place, undisturbed
from cps_envs.disbanding.state import Constants, State
from cps_envs.disbanding.state import allocate as allocate_string
from cps_paper.testbed.robots.config import RobotConfig
from cps_paper.testbed.robots.dynamics import run_episode
from cps_paper.testbed.robots.observation import observe_robots
from cps_paper.testbed.robots.payoff import METRICS, measure_episode, velocity_error
from cps_paper.testbed.robots.picture.scene import Scene, scene_of
from cps_paper.testbed.robots.start import draw_episode, place_robots, string_constants
from cps_paper.testbed.robots.state import Robots, Rules, allocate, rules_of
from cps_paper.testbed.robots.swarm import RobotTeam


class Account(NamedTuple):
    """The attacker's budget that is left, its legal attacks, and the velocity error that it is paid for."""

    budget: IntArray  # (B,) platoons that the attacker may still disband
    legal: BoolArray  # (B, N + 1) attacks
    velocity_error: FloatArray  # (B,) percent, of the robots as they are


@kernel
def step(
    robots: Robots,
    string: State,
    constants: Array,
    account: Account,
    metrics: Array,
    rules: Array,
    targets: IntArray,
    correction: FloatArray,
    envs: BoolArray,
    num_periods: int,
) -> None:
    """Disband `targets` (B,) where legal, run marked environments under `correction` (B, M) in m/s2 of road; settle."""
    r, closing = unpack(Rules, rules, 0), np.empty(correction.shape[1])
    for b in range(envs.size):
        if envs[b]:
            own, episode, c, known = view(robots, b), view(string, b), unpack(Constants, constants, b), view(account, b)
            disband(episode, c, targets[b], known.budget, known.legal)
            run_episode(own, episode, c, r, borrowed(correction)[b], closing, num_periods)
            settle(own, episode, c, known, borrowed(metrics)[b], r)


@kernel
def settle_all(
    robots: Robots, string: State, constants: Array, account: Account, metrics: Array, rules: Array, envs: BoolArray
) -> None:
    """`settle` for the marked environments."""
    r = unpack(Rules, rules, 0)
    for b in range(envs.size):
        if envs[b]:
            episode, c = view(string, b), unpack(Constants, constants, b)
            settle(view(robots, b), episode, c, view(account, b), borrowed(metrics)[b], r)


@inlined
def settle(robots: Robots, episode: State, c: Constants, account: Account, metrics: Record, rules: Rules) -> None:
    """Bring metrics of the string as the filters see it, payoff and legal attacks up to the state."""
    measure(episode, c, rules.num_periods, metrics)
    account.velocity_error[0] = velocity_error(robots.error, episode.disbanding_s, rules)
    mark_legal(episode, c, account.budget[0], rules.periods_per_attack, account.legal)


class RobotGame(Game):
    """A game step is a control period of the robots; the attacker decides at whole seconds from 1 s on.

    Roles, actions and observations are those of `DisbandingGame` under `config.road`. Policies of the disbanding
    problem see a road that is `config.scale` times as large as the circle. They see it through the filters' estimates.

    Payoff: the increase of E_v (2.8) in percent over the robots that are not disbanded, inside its window.
    """

    name = "testbed"
    threaded = True
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
        self._rules = pack(rules_of(config))
        self.robots: Robots = allocate(config, num_envs)
        self.string: State = allocate_string(num_envs, config.num_platoons, config.vehicles_per_platoon)
        self.constants = np.repeat(pack(string_constants(config)), num_envs)
        steady = undisturbed(self.constants, config.num_robots)
        self._start = steady._replace(driver_headway_s=np.full_like(steady.driver_headway_s, config.driver_headway_s))
        self._account = Account(
            budget=np.zeros(num_envs, np.int64),
            legal=np.zeros((num_envs, config.num_platoons + 1), np.bool_),
            velocity_error=np.zeros(num_envs),
        )
        self._metrics = records(Metrics, num_envs)
        shared = (self.constants, hold(self._account), self._metrics, self._rules)
        self._known = (hold(self.robots), hold(self.string), *shared)
        self._waiting = np.zeros(num_envs, np.int64)
        self._still = np.zeros((num_envs, config.num_robots))

    def spec(self, role: Role) -> RoleSpec:
        """The interface of a role of the disbanding problem, whose policies play here."""
        return replace(super().spec(role), problem="disbanding", config=self.config.road)

    def _reset(self, envs: BoolArray, generators: Generators) -> None:
        place(self.string, self.constants, self._start, envs)
        self._account.budget[envs] = self.config.road.max_budget
        for b in np.flatnonzero(envs).tolist():
            robots = view(self.robots, b)
            draw_episode(robots, self.config, generators[b])
            place_robots(robots, self.config, self.string.position[b] / self.config.scale)
            self.string.speed[b] = self.config.scale * robots.speed
        settle_all(*self._known, envs)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        before = self._account.velocity_error.copy()
        targets = actions.get("attacker", self._waiting)
        correction = self.max_correction_mps2 * actions["defender"] if "defender" in actions else self._still
        self.threads.run(lambda mine: step(*self._known, targets, correction, mine, num_steps), envs, num_steps)
        return self._account.velocity_error - before

    def observe(self, role: Role) -> Observation:
        """See `disbanding.fields`."""
        fields = self.fields[role]
        encoded = np.empty((self.num_envs, fields.size), np.float32)
        known = (self._known[1], self.constants, self._metrics)
        if role == "attacker":
            observe_attacker(*known, self._account.budget, fields.offsets, fields.scale, encoded)
        else:
            observe_robots(*known, self._rules, fields.offsets, fields.scale, encoded)
        return encoded

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal attacks (B, N + 1); the defender's corrections are always legal."""
        return self._account.legal.copy() if role == "attacker" else None

    def team(self, role: Role) -> Team:
        """The defender as one agent per robot."""
        if role == "attacker":
            return super().team(role)
        return RobotTeam(self.config, self._known[1], self.constants)

    @property
    def intact(self) -> BoolArray:
        """The robots (B, M) of platoons never disbanded so far."""
        intact: BoolArray = np.repeat(np.isinf(self.string.disbanding_s), self.config.vehicles_per_platoon, axis=1)
        return intact

    def metrics(self) -> dict[str, Array]:
        """`payoff.METRICS` so far, each (B,)."""
        intact = self.intact
        rows = [
            measure_episode(view(self.robots, b), int(self.string.step[b]), intact[b], self.config)
            for b in range(self.num_envs)
        ]
        return dict(zip(METRICS, (self._account.velocity_error.copy(), *np.array(rows).T), strict=True))

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        return scene_of(self.robots, self.string, b, self.config, self.episode_metrics(b))
