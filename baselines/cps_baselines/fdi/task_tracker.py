"""A tracker whose margins depend on what it attacks, and that finds out whether anybody defends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.injection import View, view_of
from cps_baselines.fdi.platoon_filter import platoon_filter
from cps_baselines.fdi.tracker import Tracker
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, State

PROBE_STEPS = 2  # until it shows whether readings of a probe were used
LOUD_S = 2.0  # of lies that open the gap where nobody defends, as `swing`


class Manner(NamedTuple):
    """How a kind of task is attacked, each (B,); the first four as in `Tracker`, in deviations but for the seconds."""

    margin: FloatArray
    late: FloatArray
    swing: FloatArray
    swing_s: FloatArray
    range_part: FloatArray
    shy: FloatArray  # added to the margin after a step in which a lie was not used
    sight: FloatArray  # from 0 to 1: how far the filter is taken to be off as it is, not as the lies so far should do
    bold: FloatArray  # added to it after one in which an honest reading of the gap was not used


KINDS = ("one", "pair", "inner", "most")  # one sensor of the lead, both, up to two of another gap, three of it


class TaskTracker(Tracker):
    """`Tracker` with a `Manner` for each kind of task, and a probe first.

    The probe is a lie of `probe` deviations that opens the gap. Every defender with a gate replaces it; where it is
    used, nobody defends, and the lies are as large as they can be from then on.

    `manners` (B, 4, 8) are those of each episode of a batch, or of all where B is 1, in the order of `KINDS`.
    """

    def __init__(self, spec: RoleSpec, manners: FloatArray, probe: FloatArray) -> None:
        super().__init__(spec, range_part=1.0)
        self.manners, self.probe = manners, probe
        n, slots = self.config.num_vehicles, self.form.sensors
        self._pair: IntArray = platoon_filter(self.config).view.argmax(axis=1) % n  # (R,) the gap of each sensor
        self._ranges: BoolArray = slots < self.config.num_readings // 2

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """As `Tracker`, and whether each episode (B,) is known to have no defender."""
        found = super().begin(generators, knowledge)
        assert found is not None
        return (*found, np.zeros(len(generators), np.bool_))

    def track(self, seen: Seen, state: State, more: FloatArray) -> tuple[Array, State]:
        """Actions (B, S) with `more` (B, 2) added to the margins of ranges and of range-rates."""
        actions, quiet = super().track(seen, state[:3], more)
        assert quiet is not None
        views, first = view_of(self.form, seen), quiet[2]
        since = np.where(first >= 0, views.step - first, -1)
        used = (seen["trust"][:, self.form.sensors] > 0.5) | ~views.attacked
        undefended = state[3] | ((since == PROBE_STEPS) & used.all(axis=1))
        opens = since < PROBE_STEPS + LOUD_S / self.config.dt_s
        loud = np.where(opens[:, np.newaxis], -self.form.bounds, self.form.bounds) * views.attacked
        shouted = self.say(views, np.rint(loud).astype(np.int64), seen.masks)
        return np.where(undefended[:, np.newaxis], shouted, actions), (*quiet, undefended)

    def _look(self, views: View, shown: FloatArray, off: FloatArray) -> FloatArray:
        """As `Tracker`, with part of its sight."""
        sight = self._manner(views.attacked).sight[:, np.newaxis]
        return sight * shown + (1 - sight) * off

    def _manner(self, attacked: BoolArray) -> Manner:
        """How episodes are attacked in which these slots (B, S) are."""
        count = len(attacked)
        manners = np.resize(self.manners, (count, *self.manners.shape[1:]))
        return Manner(*manners[np.arange(count), self._kinds(attacked)].T)

    def _margins(self, seen: Seen, views: View, first: FloatArray) -> FloatArray:
        """The margins (B, S), see the class."""
        m, probe = self._manner(views.attacked), np.resize(self.probe, len(seen))
        since, whole, swing_steps = views.step - first, self.config.horizon - first, m.swing_s / self.config.dt_s
        part = np.clip(
            (since - PROBE_STEPS - swing_steps) / np.maximum(whole - PROBE_STEPS - swing_steps, 1.0), 0.0, 1.0
        )
        margin = np.where(since - PROBE_STEPS < swing_steps, -m.swing, m.margin + (m.late - m.margin) * part)
        refused = seen["trust"] < 0.5
        own, gap = np.zeros_like(refused), self._pair[self.form.sensors][views.attacked.argmax(axis=1)]
        own[:, self.form.sensors] = views.attacked
        margin = margin + m.shy * (refused & own).any(axis=1)
        margin = margin + m.bold * (refused & ~own & (self._pair == gap[:, np.newaxis])).any(axis=1)
        margin = np.where(since < PROBE_STEPS, np.where(since == 0, -probe, 0.0), margin)
        return margin[:, np.newaxis] * np.where(self._ranges, m.range_part[:, np.newaxis], 1.0)

    def _kinds(self, attacked: BoolArray) -> IntArray:
        """The places (B,) in `KINDS` of what is attacked (B, S)."""
        lead = self._pair[self.form.sensors][attacked.argmax(axis=1)] == self.config.num_vehicles - 1
        count = attacked.sum(axis=1)
        return np.where(lead, np.minimum(count, 2) - 1, np.where(count < 3, 2, 3))
