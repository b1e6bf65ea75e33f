"""The disbanding game: B strings of platoons, an attacker who disbands, a defender who corrects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.generators import drawing
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import pack, records
from cps_envs.core.declare.columns import ActionColumn, counted, numbered
from cps_envs.core.declare.measures import Measure, measures_of
from cps_envs.core.game.game import Adapters, Game
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.disbanding.adapters import Follow, FollowRoad, Vehicle
from cps_envs.disbanding.circumstances import circumstances_of, draw_circumstances
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.controllers import TIME_TOLERANCE
from cps_envs.disbanding.events import is_eventful
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.observation import observe_attacker, observe_defender
from cps_envs.disbanding.parts import PartsRoad
from cps_envs.disbanding.payoff import MEASURED, Metrics, Rules
from cps_envs.disbanding.picture.scene import Scene
from cps_envs.disbanding.start import builds_of, chances_of, nominal_constants, spread, start_drawn
from cps_envs.disbanding.state import Constants, State, allocate
from cps_envs.disbanding.swarm import VehicleTeam
from cps_envs.disbanding.timed import FromFront, Timed
from cps_envs.disbanding.truth import truth_of_road
from cps_envs.disbanding.turn import Account, settle_all, step, step_eventful

CHARGES = ("collision_penalty", "end_charge")  # paid beside the velocity error


class DisbandingGame(Game):
    """A game step is a control period; the attacker decides at whole seconds from 1 s on, the defender every period.

    Attacker: Discrete(N + 1), 0 = wait, i = disband the paper's platoon i (1 = rear). Illegal choices mean waiting.
    With `attack="jolt"` i makes the platoon's attacked vehicle brake for a moment; drivers whom that alarms take over.
    With a budget of jamming: Discrete(2 N), N + i = block the radio link ahead of platoon i from now on, i < N.
    Defender: Box (M,) front to rear, or (N,) with row i - 1 for platoon i. Times u_max - u_min it is the correction of
    the commanded acceleration, held for the period. Vehicles that are not mitigable ignore it.

    Payoff: the increase of E_v (2.8) in percent, plus the collision penalty and the charge of an early end, or what
    `payoff` says.
    """

    name = "disbanding"
    measures: ClassVar[Mapping[str, Measure]] = measures_of(Metrics)
    adapters: ClassVar[Adapters] = {
        "attacker": {"timed": Timed, "from_front": FromFront},
        "defender": {"vehicle": Vehicle, "follow": Follow, "follow_road": FollowRoad, "parts_road": PartsRoad},
    }
    threaded = True

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
            "attacker": spaces.Discrete(config.num_attacks),
            "defender": spaces.Box(-1.0, 1.0, (corrections,), np.float32),
        }
        self.neutral_action = {"attacker": np.array(0), "defender": np.zeros(corrections)}
        self.max_correction_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        intact_now, self._eventful = config.payoff_set == "intact_now", is_eventful(config)
        self.payoff_parts = ("velocity_error_intact_now" if intact_now else "velocity_error_all", *CHARGES)
        rules = Rules(
            horizon_steps=config.horizon_steps,
            collision_penalty=config.collision_penalty,
            pays_intact_now=intact_now,
            steps_per_decision=config.periods_per_second * config.steps_per_period,
            eventful=self._eventful,
        )
        self._measures = Metrics._fields[: MEASURED[config.report]]
        self._rules = pack(rules)
        self._draw_from(config)
        self._allocate()
        self.pay_as_configured()

    def _allocate(self) -> None:
        config, envs = self.config, self.num_envs
        kept = {"differ": config.differ, "jolts": config.attack == "jolt", "watchful": config.watchful}
        self.state: State = allocate(envs, config.max_platoons, config.vehicles_per_platoon, **kept)
        self.constants = records(Constants, envs)
        self.constants[:] = pack(nominal_constants(config))
        self.budget: IntArray = np.zeros(envs, np.int64)
        legal = np.zeros((envs, config.num_attacks), np.bool_)
        self._account = Account(self.budget, legal, np.zeros(envs))
        self._metrics = records(Metrics, envs)
        self._known = (hold(self.state), self.constants, hold(self._account), self._metrics, self._rules)
        self._waiting = np.zeros(envs, np.int64)
        self._still = np.zeros((envs, config.max_vehicles))

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        with drawing(generators, np.flatnonzero(envs)) as streams:
            drawn = (self._known[0], self.constants, self.budget, streams, envs)
            start_drawn(*drawn, self._chances, self._spread, self._builds)
            draw_circumstances(*drawn, self._circumstances)
        self._settle(envs)

    def _draw_from(self, drawn: DisbandingConfig) -> None:
        self._spread, self._chances, self._circumstances = spread(drawn), chances_of(drawn), circumstances_of(drawn)
        self._builds = hold(builds_of(drawn))

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        targets = actions.get("attacker", self._waiting)
        correction = self._correction(actions["defender"]) if "defender" in actions else self._still
        before, steps = self._account.total.copy(), num_steps * self.config.steps_per_period
        move = step_eventful if self._eventful else step
        self.threads.run(lambda mine: move(*self._known, targets, correction, mine, steps), envs, num_steps)
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
        present = self.constants["num_vehicles"] // size
        row = present[:, np.newaxis] - 1 - np.arange(self.config.max_platoons)
        return np.repeat(np.take_along_axis(rows, np.maximum(row, 0), axis=1), size, axis=1)

    def _settle(self, envs: BoolArray) -> None:
        settle_all(*self._known, envs)

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        fields = self.fields[role]
        encoded = np.empty((self.num_envs, fields.size), np.float32)
        known = (self._known[0], self.constants, self._metrics)
        if role == "attacker":
            observe_attacker(*known, self.budget, fields.offsets, fields.scale, encoded)
        else:
            observe_defender(*known, fields.offsets, fields.scale, encoded)
        return encoded

    def truth(self, b: int) -> Mapping[str, Array]:
        """Privileged: when the platoons of an episode are disbanded (N,), and how its vehicles move, (M,) each.

        Both are numbered from the front. All are views, which change with the episode.
        """
        names = ("disbanding_s", "position", "speed", "acceleration", "command")
        return {name: getattr(self.state, name)[b] for name in names}

    def privileged(self, role: Role) -> Observation:
        """See `truth.truth_of_road`, (B, 5 + 6 N)."""
        return truth_of_road(self.config, self.state, self.constants, self.budget)

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal attacks (B, N + 1) or (B, 2 N); the defender's corrections are always legal."""
        return self._account.legal.copy() if role == "attacker" else None

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """Legal attacks (N + 1,) or (2 N,) of one episode as int8."""
        return self._account.legal[b].astype(np.int8) if role == "attacker" else None

    def metrics(self) -> dict[str, Array]:
        """`payoff.Metrics` so far, each (B,)."""
        return {name: self._metrics[name] for name in self._measures}

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(self._measures, self._metrics.item(b)))  # noqa: B905, strict costs a microsecond; it may be longer

    def parts(self) -> tuple[Array, ...]:
        """See the base class."""
        return (*self.state, self.constants, self.budget)

    def refresh(self) -> None:
        """Settle everybody's account again."""
        self._settle(np.ones(self.num_envs, np.bool_))

    def num_present_platoons(self, b: int) -> int:
        """N of an episode, where it is drawn."""
        return int(self.constants["num_vehicles"][b]) // self.config.vehicles_per_platoon

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        state, present = self.state, slice(0, int(self.constants["num_vehicles"][b]))
        return Scene(
            config=self.config,
            time_s=float(state.step[b] * self.constants["dt_s"][b]),
            position=state.position[b, present].copy(),
            speed=state.speed[b, present].copy(),
            disbanding_s=state.disbanding_s[b, : present.stop // self.config.vehicles_per_platoon].copy(),
            takeover_delay_s=state.takeover_delay_s[b, present].copy(),
            collided=state.collided[b, present].copy(),
            metrics=self.episode_metrics(b),
            warned=np.isfinite(state.record_s[b, present]) if self.config.is_relayed else None,
            jolted=self._jolted(b),
            jammed_after=int((state.jam_place[b] + 1) * self.config.vehicles_per_platoon - 1),
        )

    def _jolted(self, b: int) -> tuple[tuple[int, int], ...]:
        """Platoon (1 = rear) and vehicle (1 = leader) of each vehicle of an episode that brakes by a false reading."""
        state, size = self.state, self.config.vehicles_per_platoon
        time_s = state.step[b] * self.constants["dt_s"][b]
        found = np.flatnonzero(state.jolted_until_s[b] > time_s + TIME_TOLERANCE).tolist()
        platoons = self.num_present_platoons(b)
        return tuple((platoons - q // size, q % size + 1) for q in found if state.disbanding_s[b, q // size] > time_s)

    def columns(self, role: Role) -> tuple[ActionColumn, ...]:
        """The attack as a number, or corrections in m/s2."""
        if role == "attacker":
            return numbered(["attack"], "-", "0 waits, i attacks platoon i (1 = rear), N + i jams ahead of it")
        count, which = self.action_space[role].shape[0], self.config.defense_action  # type: ignore[index]
        meaning = f"of each {which}, {'front to rear' if which == 'vehicle' else 'rear to front'}"
        return numbered(counted("correction_mps2", count), "m/s2", meaning, self.max_correction_mps2)

    def team(self, role: Role) -> Team:
        """The defender as one agent per vehicle."""
        if role == "attacker":
            return super().team(role)
        return VehicleTeam(self.config, self._known[0], self.constants, self.budget, self.elapsed)
