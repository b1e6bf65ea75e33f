"""An attacker that knows the filter: its lies keep the innovations of the attacked sensors at a chosen level."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.fdi.injection import InjectionPolicy, View, view_of
from cps_baselines.fdi.platoon_filter import platoon_filter, trusting
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray


class Tracker(InjectionPolicy):
    """Tells a vehicle that the gap ahead opens, so slowly that the filter takes it for a disturbance.

    Each lie is chosen so that the expected innovation of its sensor is a `margin` times the standard deviation that
    the filter expects. The margin goes evenly from `margin` to `late` at the end of the episode. For the first
    `swing_s` the lies go the other way, at `swing`, so that the gap opens and leaves room to gain speed.
    `range_part` is what part of the margin ranges get. What rounding to levels leaves over goes into the next lie. The
    defaults are the best found against `cusum`.

    With `sight` it sees the filter's prediction; otherwise it knows the filter's gains only, and what its own lies do.

    Raises:
        ConfigurationError: a negative time, or no filter.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        margin: float = 0.95,
        late: float = 1.3,
        swing: float = 1.1,
        swing_s: float = 0.1,
        range_part: float = 1.2,
        sight: bool = True,
    ) -> None:
        super().__init__(spec)
        if swing_s < 0:
            raise ConfigurationError(f"swing_s = {swing_s} must be 0 or more")
        self.margin, self.late, self.swing, self.sight = margin, late, swing, sight
        self.swing_steps = swing_s / self.config.dt_s
        law = platoon_filter(self.config)
        (gains, deviations), slots = trusting(self.config), self.form.sensors
        part = np.where(slots < self.config.num_readings // 2, range_part, 1.0)
        self._deviation: FloatArray = deviations[:, slots] * part
        self._view: FloatArray = law.view[slots]
        self._stay: FloatArray = law.coast @ (np.eye(len(law.coast)) - gains @ law.view)  # (k, 2n, 2n)
        self._lie: FloatArray = law.coast @ gains[:, :, slots]  # (k, 2n, S)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What the filter is off by (B, 2n), what rounding left over (B, S), the first step of the attack (B,)."""
        envs, (pairs, slots) = len(generators), self._lie.shape[1:]
        return np.zeros((envs, pairs)), np.zeros((envs, slots)), np.full(envs, -1.0)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        off, left, first = state
        views = view_of(self.form, seen)
        off = self._look(seen, views, off)
        told = seen["injection"] * self.form.bounds * self.form.resolution
        step = np.minimum(views.step, self.config.horizon - 1)
        ahead = np.einsum("bij,bj->bi", self._stay[step], off) - np.einsum("bij,bj->bi", self._lie[step], told)
        works = np.rint(seen["wait"][:, 0]) == 0
        first = np.where(works & (first < 0), views.step, first)
        margins = self._margins(seen, views, first)
        wanted = margins * self._deviation[step + 1] - ahead @ self._view.T + left
        active = views.attacked & works[:, np.newaxis]
        levels = np.where(active, np.rint(wanted / self.form.resolution), 0.0)
        half = self.form.resolution / 2
        left = np.where(active, np.clip(wanted - levels * self.form.resolution, -half, half), 0.0)
        return self.say(views, levels.astype(np.int64), seen.masks), (ahead, left, first)

    def _look(self, seen: Seen, views: View, off: FloatArray) -> FloatArray:
        """What the filter is off by (B, 2n), of which `off` is what it should be by the lies so far."""
        return seen_off(seen, views) if self.sight else off

    def _margins(self, seen: Seen, views: View, first: FloatArray) -> FloatArray:
        """The margins (B, 1) or (B, S) of lies that began at the steps `first` (B,)."""
        whole = self.config.horizon - first
        part = self._part(views.step - first, whole, self.swing_steps)
        opens = views.step - first < self.swing_steps
        return np.where(opens, -self.swing, self.margin + (self.late - self.margin) * part)[:, np.newaxis]

    def _part(self, since: FloatArray, whole: FloatArray, swing_steps: FloatArray | float) -> FloatArray:
        """How much of the time after the swing is over (B,), so many steps after the first of `whole`."""
        part: FloatArray = np.clip((since - swing_steps) / np.maximum(whole - swing_steps, 1.0), 0.0, 1.0)
        return part


def seen_off(seen: Seen, views: View) -> FloatArray:
    """What the filter is off by (B, 2n)."""
    off: FloatArray = views.error - np.concatenate([seen["predicted_gap_error"], seen["predicted_speed"]], axis=1)
    return off


def blind_tracker(spec: RoleSpec, **options: Any) -> Tracker:
    """Plays `tracker` without seeing the filter's prediction."""
    return Tracker(spec, **{"sight": False, **options})
