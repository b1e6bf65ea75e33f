"""The false-data-injection game: B platoons, an attacker who adds to sensor readings, a defender who doubts them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.generators import drawing
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import records, view
from cps_envs.core.declare.columns import ActionColumn, counted, numbered
from cps_envs.core.declare.measures import Measure, measures_of
from cps_envs.core.game.game import Adapters, Game
from cps_envs.core.policies.inside import InsidePhysics
from cps_envs.core.policies.team import Team
from cps_envs.core.types import ROLES, Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.fdi import inside
from cps_envs.fdi.adapters.motion import Motion
from cps_envs.fdi.adapters.sensor import Sensor
from cps_envs.fdi.config import FdiConfig, has_preset_sizes
from cps_envs.fdi.drawing import chances_of, draw, draws_anything, has_own_constants
from cps_envs.fdi.dynamics import begin, step, step_filtered
from cps_envs.fdi.filtered import observe_filtered
from cps_envs.fdi.observation import (
    attacker_fields,
    defender_fields,
    fill_masks,
    is_drawn,
    num_slots,
    observe_attacker,
    observe_defender,
)
from cps_envs.fdi.payoff import OF_DUELS, OF_INSTABILITY, PAID, PAID_FOR_INSTABILITY, Metrics
from cps_envs.fdi.picture.scene import Scene
from cps_envs.fdi.privileged import hidden_from_attacker, hidden_from_defender
from cps_envs.fdi.selection import certificates, chosen_tasks
from cps_envs.fdi.state import Batch, Layout, State, allocate, constants_of, matrices_of
from cps_envs.fdi.team import SensorTeam


class FdiGame(Game):
    """A game step is a sampling period of the controller; both roles decide at every one.

    Attacker: MultiDiscrete, one entry per attacked sensor (ranges first, by vehicle), or per sensor of the platoon
    where tasks are drawn. Entry a injects (a - bound) times the resolution.
    Defender: MultiDiscrete (3n,): for each reading (ranges 1..n, then range-rates) 1 = trust, 0 = replace; for each
    vehicle a correction level, `correction_levels` = none. It decides on the readings of the step before.

    With a filter (`estimator="kalman"`) there are readings of the rears too, (5n - 2,), and the defender decides on
    those that are used now. What the attacker injects is added to the readings of the next step.

    Payoff: the impact speed at the end (m/s), or with goal "instability" the growth of the errors in each step (m).
    The defender's charges for replaced readings and corrections are added. Or what `payoff` says.
    """

    name = "fdi"
    measures: ClassVar[Mapping[str, Measure]] = measures_of(Metrics)
    adapters: ClassVar[Adapters] = {
        "attacker": {"motion": Motion},
        "defender": {"sensor": Sensor},
    }
    threaded = True

    def __init__(self, config: FdiConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: FdiConfig = config
        self.horizon, self.step_s = config.horizon, config.dt_s
        self._filters, unstable = config.estimator == "kalman", config.goal == "instability"
        self.payoff_parts = PAID_FOR_INSTABILITY if unstable else PAID
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        self.tasks = chosen_tasks(config)
        self._set_actions()
        self.state: State = allocate(config, num_envs, num_slots(config))
        known = certificates(config, self.tasks)
        self._metrics, self._openings = records(Metrics, num_envs), records(Metrics, len(self.tasks))
        self._openings["bound_valid"], self._openings["oracle_bound_mps"] = known.valid, known.bound
        self._openings["oracle_value_mps"] = known.value
        self._draws = draws_anything(config)
        self._draw_from(config)
        self._constants: Array = constants_of(config)
        if has_own_constants(config):
            self._constants = np.repeat(self._constants, num_envs)
        left_out = (() if self._filters else OF_DUELS) + (() if unstable else OF_INSTABILITY)
        self._measured = [name for name in Metrics._fields if name not in left_out]
        shared = (self._tasks, self._constants, matrices_of(config))
        layouts = [Layout(self.fields[role].offsets, self.fields[role].scale) for role in ROLES]
        batch = Batch(self.state, self._metrics, self.terminated, *shared, *layouts)
        self._batch = hold(batch, told=has_preset_sizes(config))
        self._episodes: IntArray = np.arange(num_envs)
        self._waiting: IntArray = np.repeat(self.neutral_action["attacker"][np.newaxis], num_envs, axis=0)
        self._trusting: IntArray = np.zeros((num_envs, 0), np.int64)
        self.pay_as_configured()

    def _set_actions(self) -> None:
        config, n, readings = self.config, self.config.num_vehicles, self.config.num_readings
        flags = [task.sensors.flags(n, rear=self._filters) for task in self.tasks]
        self._flags: BoolArray = np.array(flags)  # (T, R)
        sensors = range(readings) if is_drawn(config) else np.flatnonzero(flags[0]).tolist()
        self._sensors = tuple(sensors)
        levels = [config.range_levels if sensor < readings // 2 else config.rate_levels for sensor in sensors]
        self._levels: IntArray = np.array(levels, np.int64)
        doubts, corrections = [2] * readings, [2 * config.correction_levels + 1] * n
        self.action_space = {
            "attacker": spaces.MultiDiscrete(2 * self._levels + 1),
            "defender": spaces.MultiDiscrete(doubts + corrections),
        }
        self.neutral_action = {
            "attacker": self._levels.copy(),
            "defender": np.array([1] * readings + [config.correction_levels] * n),
        }
        self._mask_size = int((2 * self._levels + 1).sum())
        rows = [
            [j if marks[j] else -1 for j in sensors] + [task.target - 1]
            for marks, task in zip(flags, self.tasks, strict=True)
        ]
        self._tasks: IntArray = np.array(rows, np.int64)

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        if self._draws:
            with drawing(generators, np.flatnonzero(envs)) as streams:
                draw(self._batch, streams, envs, self._chances)
        begin(self._batch, self._openings, self._episodes, envs)

    def _draw_from(self, drawn: FdiConfig) -> None:
        self._chances = chances_of(drawn, len(self.tasks))
        self._chances["own_constants"] = has_own_constants(self.config)  # the arrays are made so

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        payoff, move = np.zeros(self.num_envs), step_filtered if self._filters else step
        attack, defense = actions.get("attacker", self._waiting), actions.get("defender", self._trusting)
        if self.threads.alone:
            move(self._batch, attack, defense, envs, num_steps, payoff)
        else:
            given = (self._batch, attack, defense)
            self.threads.run(lambda mine: move(*given, mine, num_steps, payoff), envs, num_steps)
        return payoff

    def observe(self, role: Role) -> Observation:
        """See `observation.attacker_fields` and `observation.defender_fields`."""
        observations = np.empty((self.num_envs, self.fields[role].size), np.float32)
        observe = observe_attacker
        if role == "defender":
            observe = observe_filtered if self._filters else observe_defender
        observe(self._batch, observations)
        return observations

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal injections (B, sum of levels); each sensor's row supposes that the others help."""
        if role == "defender":
            return None
        masks = np.empty((self.num_envs, self._mask_size), np.int8)
        fill_masks(self.state.legal, self._levels, masks)
        return masks.view(np.bool_)

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """`action_mask` of one episode as int8."""
        if role == "defender":
            return None
        masks = np.empty((1, self._mask_size), np.int8)
        fill_masks(self.state.legal if self.num_envs == 1 else self.state.legal[b : b + 1], self._levels, masks)
        mask: Array = masks[0]
        return mask

    def metrics(self) -> dict[str, Array]:
        """`payoff.Metrics` so far, each (B,)."""
        return {name: self._metrics[name] for name in self._measured}

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        values = dict(zip(Metrics._fields, self._metrics.item(b), strict=True))
        return {name: values[name] for name in self._measured}

    def task(self, b: int) -> str:
        """The task of an episode, such as "x4>4"."""
        return str(self.tasks[self.state.task[b]])

    def episode(self, b: int) -> State:
        """The state of one episode; its arrays are views."""
        return view(self.state, b)

    def gains(self, b: int) -> tuple[float, float]:
        """k_p (1/s2) and k_d (1/s) of an episode."""
        row = self._constants[min(b, len(self._constants) - 1)]
        return float(row["proportional_gain"]), float(row["derivative_gain"])

    def truth(self, b: int) -> Mapping[str, Any]:
        """Privileged: the attacked readings (R,), and the first step whose readings injections may change."""
        return {"attacked": self._flags[self.state.task[b]], "onset": int(self.state.onset[b])}

    def privileged(self, role: Role) -> Observation:
        """See `privileged.hidden_from_attacker` and `privileged.hidden_from_defender`."""
        if role == "attacker":
            return hidden_from_attacker(self.config, self.state)
        return hidden_from_defender(self.config, self.state, self._flags[self.state.task])

    def inside(self) -> InsidePhysics:
        """See the base class."""
        held = inside.Held(self._batch, self._openings, self._episodes, self._chances)
        defender = inside.show_filtered if self._filters else inside.show_defender
        reset = inside.reset if self._draws else inside.reset_exact
        return InsidePhysics(held, reset, inside.advance, {"attacker": inside.show_attacker, "defender": defender})

    def columns(self, role: Role) -> tuple[ActionColumn, ...]:
        """Injections in m and m/s, or which readings are trusted and corrections in m/s2."""
        config, half = self.config, self.config.num_readings // 2
        if role == "defender":
            trusted = numbered(counted("trust", 2 * half), "-", "1 trusts the reading, 0 replaces it; ranges first")
            step = config.max_correction_mps2 / config.correction_levels
            names = counted("correction_mps2", config.num_vehicles)
            return trusted + numbered(names, "m/s2", "from the last vehicle on", step, config.correction_levels)
        found = []
        for sensor, level in zip(self._sensors, self._levels.tolist(), strict=True):
            ranges = sensor < half
            name = f"range_injection_m_{sensor + 1}" if ranges else f"rate_injection_mps_{sensor - half + 1}"
            step = config.range_resolution_m if ranges else config.rate_resolution_mps
            found.append(ActionColumn(name, "m" if ranges else "m/s", "fronts by vehicle, then rears", step, level))
        return tuple(found)

    def team(self, role: Role) -> Team:
        """The defender's sensors, see `team.SensorTeam`; there are none without a filter."""
        if role == "attacker" or not self._filters:
            return super().team(role)
        targets = self._tasks[:, -1]
        return SensorTeam(self.config, self.state, self._metrics, self.terminated, self._flags, targets)

    def parts(self) -> tuple[Array, ...]:
        """See the base class."""
        own = (self._constants,) if has_own_constants(self.config) else ()
        return (*self.state, *own, self._metrics)

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        config, n, state = self.config, self.config.num_vehicles, self.episode(b)
        task, half, filters = self.tasks[self.state.task[b]], self.config.num_readings // 2, self._filters
        order = np.r_[:n, half : half + n, n:half, half + n : 2 * half]  # front sensors first
        rates = slice(half, half + n)
        believed = state.prediction if filters else np.full(2 * n, np.nan)
        return Scene(
            config=config,
            episode=int(self._episodes[b]),
            time_s=float(self.state.step[b] * config.dt_s),
            target=task.target,
            gap=state.error[:n] + config.desired_gap_m,
            closing_speed=-state.error[n:],
            reported_gap=state.reading[:n] + config.desired_gap_m,
            reported_closing_speed=-state.reading[rates],
            used_gap=state.used[:n] + config.desired_gap_m,
            used_closing_speed=-state.used[rates],
            believed_gap=believed[:n] + config.desired_gap_m,
            believed_closing_speed=-believed[n:],
            injection=state.injection[order],
            attacked=task.sensors.flags(n, rear=filters)[order],
            trusted=state.trust[order] > 0,
            attack_from_s=float(self.state.onset[b] * config.dt_s),
            command=state.command.copy(),
            metrics=self.episode_metrics(b),
        )
