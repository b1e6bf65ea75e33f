"""The false-data-injection game: B platoons, an attacker who adds to sensor readings, a defender who doubts them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces

from cps_envs.core.game import Game
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.fields import attacker_fields, defender_fields, is_drawn, num_slots
from cps_envs.fdi.masks import fill_mask, fill_masks
from cps_envs.fdi.memory import (
    BLOCKS_PER_VEHICLE,
    NUM_COUNTS,
    STEP,
    TASK,
    Memory,
    memory_of,
    pack_constants,
    pack_matrices,
)
from cps_envs.fdi.metrics import BOUND, BOUND_VALID, METRICS, PAID, PAYOFF, VALUE
from cps_envs.fdi.observation import observe_attacker, observe_defender
from cps_envs.fdi.scene import Scene
from cps_envs.fdi.selection import certificates, chosen_tasks
from cps_envs.fdi.turn import open_episodes, take_turn


class FdiGame(Game):
    """A game step is a sampling period of the controller; both roles decide at every one.

    Attacker: MultiDiscrete, one entry per attacked sensor (ranges first, by vehicle), or per sensor of the platoon
    where tasks are drawn. In the form "level" entry a injects (a - bound) times the resolution; in the form "share" 0
    injects nothing and 1 to `share_levels` go evenly from the lowest to the highest legal injection.
    Defender: MultiDiscrete (3n,): for each reading (ranges 1..n, then range-rates) 1 = trust, 0 = replace; for each
    vehicle a correction level, `correction_levels` = none. It decides on the readings of the step before.

    Payoff: impact speed at the end (m/s), plus what the defender is charged for replaced readings and corrections.
    """

    name = "fdi"
    payoff_parts = PAID

    def __init__(self, config: FdiConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: FdiConfig = config
        self.horizon, self.step_s = config.horizon, config.dt_s
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        self.tasks = chosen_tasks(config)
        self._drawn = is_drawn(config)
        self._set_actions()
        self._packed, self._stacked = pack_constants(config), pack_matrices(config)
        known = certificates(config, self.tasks)
        self._openings: FloatArray = np.zeros((len(METRICS) + 1, len(self.tasks)))  # columns of the table at time 0
        self._openings[[BOUND_VALID, BOUND, VALUE]] = known.valid, known.bound, known.value
        self._spread = np.repeat([config.gap_spread_m, config.speed_spread_mps], config.num_vehicles)
        self._random = self._drawn or bool(self._spread.any()) or config.disturbance_mps2 > 0
        self._allocate()

    def _set_actions(self) -> None:
        config, n = self.config, self.config.num_vehicles
        sensors = range(2 * n) if self._drawn else np.flatnonzero(self.tasks[0].sensors.flags(n)).tolist()
        levels = [config.range_levels if sensor < n else config.rate_levels for sensor in sensors]
        self._levels: IntArray = np.array(levels, np.int64)
        by_level = config.attack_action == "level"
        choices = 2 * self._levels + 1 if by_level else np.full(len(levels), config.share_levels + 1)
        doubts, corrections = [2] * (2 * n), [2 * config.correction_levels + 1] * n
        self.action_space = {
            "attacker": spaces.MultiDiscrete(choices),
            "defender": spaces.MultiDiscrete(doubts + corrections),
        }
        self.neutral_action = {
            "attacker": self._levels.copy() if by_level else np.zeros(len(levels), np.int64),
            "defender": np.array([1] * (2 * n) + [config.correction_levels] * n),
        }
        self._masked = by_level
        self._mask_size = int((2 * self._levels + 1).sum())
        rows = [[j if task.sensors.flags(n)[j] else -1 for j in sensors] + [task.target - 1] for task in self.tasks]
        self._tasks: IntArray = np.array(rows, np.int64)

    def _allocate(self) -> None:
        envs, n, config = self.num_envs, self.config.num_vehicles, self.config
        self.memories: FloatArray = np.zeros((envs, BLOCKS_PER_VEHICLE * n))
        self.counts: IntArray = np.zeros((envs, NUM_COUNTS), np.int64)
        self.table: FloatArray = np.zeros((len(METRICS) + 1, envs))
        self.legal: IntArray = np.zeros((envs, num_slots(config), 2), np.int64)
        steps = config.horizon if config.disturbance_mps2 > 0 else 0
        self._disturbances: FloatArray = np.zeros((envs, steps, n))
        self._episodes: IntArray = np.arange(envs)
        self._waiting: IntArray = np.repeat(self.neutral_action["attacker"][np.newaxis], envs, axis=0)
        self._trusting: IntArray = np.zeros((envs, 0), np.int64)

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        self.memories[envs] = 0.0
        self.counts[envs] = 0
        self._episodes[envs] += self.num_envs
        if self._random:
            for b in np.flatnonzero(envs).tolist():
                self._draw(b, generators[b])
        self.table[:, envs] = self._openings[:, self.counts[envs, TASK]]
        open_episodes(self.memories, self.counts, self.legal, envs, self._packed, self._stacked, self._tasks)

    def _draw(self, b: int, generator: np.random.Generator) -> None:
        """The task, the initial errors and the disturbances of an episode."""
        self.counts[b, TASK] = generator.integers(len(self.tasks))
        self.memories[b, : len(self._spread)] = generator.uniform(-self._spread, self._spread)
        disturbances = self._disturbances[b]
        disturbances[:] = generator.normal(0, self.config.disturbance_mps2, disturbances.shape)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        attack, defense = actions.get("attacker", self._waiting), actions.get("defender", self._trusting)
        take_turn(
            self.memories,
            self.counts,
            self.table,
            self.legal,
            attack,
            defense,
            envs,
            self.terminated,
            num_steps,
            self._disturbances,
            self._packed,
            self._stacked,
            self._tasks,
        )
        payoff: FloatArray = self.table[PAYOFF].copy()
        return payoff

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        fields = self.fields[role]
        observations = np.empty((self.num_envs, fields.size), np.float32)
        if role == "attacker":
            shared = (self.horizon, self._drawn, self._packed, self._tasks, fields.scale)
            observe_attacker(self.memories, self.counts, *shared, observations)
        else:
            observe_defender(self.memories, self.counts, self.horizon, self._packed, fields.scale, observations)
        return observations

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal injections (B, sum of levels) in the form "level"; each sensor's row supposes that the others help."""
        if role == "defender" or not self._masked:
            return None
        masks = np.empty((self.num_envs, self._mask_size), np.int8)
        fill_masks(self.legal, self._levels, masks)
        return masks.view(np.bool_)

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """`action_mask` of one episode as int8."""
        if role == "defender" or not self._masked:
            return None
        mask = np.empty(self._mask_size, np.int8)
        fill_mask(self.legal, b, self._levels, mask)
        return mask

    def metrics(self) -> dict[str, Array]:
        """`metrics.METRICS` so far, each (B,)."""
        return dict(zip(METRICS, self.table, strict=False))

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(METRICS, self.table[:, b].tolist(), strict=False))

    def task(self, b: int) -> str:
        """The task of an episode, such as "x4>4"."""
        return str(self.tasks[self.counts[b, TASK]])

    def memory(self, b: int) -> Memory:
        """Views of what an episode remembers."""
        views: Memory = memory_of.py_func(self.memories, b)  # type: ignore[attr-defined]
        return views

    def model(self, b: int, num_envs: int) -> FdiGame:
        """Privileged: copies of one episode in its present state."""
        copy = FdiGame(self.config, num_envs)
        copy.table[:] = self.table[:, b : b + 1]
        for name in ("memories", "counts", "legal", "_disturbances", "elapsed", "terminated"):
            getattr(copy, name)[:] = getattr(self, name)[b]
        return copy

    def fingerprint(self) -> bytes:
        """A digest of the state; equal for games that will go on alike under equal actions."""
        arrays = (self.memories, self.counts, self.table, self._disturbances)
        return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).digest()

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        config, n, memory = self.config, self.config.num_vehicles, self.memory(b)
        task = self.tasks[self.counts[b, TASK]]
        return Scene(
            episode=int(self._episodes[b]),
            time_s=float(self.counts[b, STEP] * config.dt_s),
            duration_s=config.horizon * config.dt_s,
            task=str(task),
            target=task.target,
            desired_gap_m=config.desired_gap_m,
            gap=memory.error[:n] + config.desired_gap_m,
            closing_speed=-memory.error[n:],
            reported_gap=memory.reading[:n] + config.desired_gap_m,
            reported_closing_speed=-memory.reading[n:],
            used_gap=memory.used[:n] + config.desired_gap_m,
            used_closing_speed=-memory.used[n:],
            injection=memory.injection.copy(),
            attacked=task.sensors.flags(n),
            trusted=memory.trust > 0,
            command=memory.command.copy(),
            max_acceleration_mps2=config.max_acceleration_mps2,
            metrics=self.episode_metrics(b),
        )
