"""An attacker that knows the filter: its lies keep the innovations of the attacked sensors at a chosen level."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.fdi.action_form import Form, new_slots, open_slots, say
from cps_baselines.fdi.injection import InjectionPolicy, View, look, new_views
from cps_baselines.fdi.platoon_filter import platoon_filter, trusting
from cps_envs.core.compute.kernels import borrowed, clip, kernel, unpack, view
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.state import Constants


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
        self._kind: IntArray = np.where(slots < self.config.num_readings // 2, 0, 1)  # (S,) 0 of a range
        part = np.where(self._kind == 0, range_part, 1.0)
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
        return self.track(seen, state, np.zeros((len(seen), 2)))

    def track(self, seen: Seen, state: State, more: FloatArray) -> tuple[Array, State]:
        """Actions (B, S) with `more` (B, 2) added to the margins of ranges and of range-rates."""
        off, left, first = state[0], state[1].copy(), state[2].copy()
        views, shown, told, works = self._seen(seen, first)
        off = self._look(views, shown, off)
        step = np.minimum(views.step, self.config.horizon - 1)
        ahead = np.einsum("bij,bj->bi", self._stay[step], off) - np.einsum("bij,bj->bi", self._lie[step], told)
        actions, expected = np.empty(views.attacked.shape, np.int64), ahead @ self._view.T
        known = (self.form.held, self.form.resolution, self._deviation, self.form.masks(seen.masks, len(seen)))
        margins = self._margins(seen, views, first) + more[:, self._kind]
        _aim(*known, views, works, margins, expected, left, actions)
        return actions, (ahead, left, first)

    def _seen(self, seen: Seen, first: FloatArray) -> tuple[View, FloatArray, FloatArray, BoolArray]:
        """What is seen: the view, what the filter is off by (B, 2n), the last lies (B, S), whether lies work (B,).

        Notes the first step (B,) at which they do.
        """
        views, (pairs, slots) = new_views(self.form, len(seen)), self._lie.shape[1:]
        shown, told, works = np.empty((len(seen), pairs)), np.empty((len(seen), slots)), np.empty(len(seen), np.bool_)
        _see(self.form.held, seen.observation, self.form.resolution, views, shown, told, works, first)
        return views, shown, told, works

    def _look(self, views: View, shown: FloatArray, off: FloatArray) -> FloatArray:
        """What the filter is off by (B, 2n): `shown`, or `off`, which it should be by the lies so far."""
        return shown if self.sight else off

    def _margins(self, seen: Seen, views: View, first: FloatArray) -> FloatArray:
        """The margins (B, 1) or (B, S) of lies that began at the steps `first` (B,)."""
        margins, numbers = np.empty((len(first), 1)), (self.swing_steps, self.swing, self.margin, self.late)
        _fill_margins(views.step, first, self.config.horizon, *numbers, margins)
        return margins


@kernel
def _fill_margins(
    step: IntArray,
    first: FloatArray,
    horizon: int,
    swing_steps: float,
    swing: float,
    margin: float,
    late: float,
    margins: FloatArray,
) -> None:
    """Fill the margins (B, 1) at steps (B,) of attacks that began at the steps `first` (B,)."""
    for b in range(step.size):
        since, whole = step[b] - first[b], horizon - first[b]
        part = clip((since - swing_steps) / max(whole - swing_steps, 1.0), 0.0, 1.0)
        margins[b, 0] = -swing if since < swing_steps else margin + (late - margin) * part


@kernel
def _see(
    form: Form,
    observation: Observation,
    resolution: FloatArray,
    views: View,
    shown: FloatArray,
    told: FloatArray,
    works: BoolArray,
    first: FloatArray,
) -> None:
    """Fill what `Tracker._seen` returns."""
    c, at, scale = unpack(Constants, form.constants, 0), form.offsets[0], form.scale
    n = shown.shape[1] // 2
    for b in range(observation.shape[0]):
        row, episode = borrowed(observation)[b], view(views, b)
        look(form, c, row, episode)
        works[b] = np.rint(decode_entry(row, scale, at.wait)) == 0.0
        if works[b] and first[b] < 0:
            first[b] = episode.step[0]
        for j in range(2 * n):
            entry = at.predicted_gap_error + j if j < n else at.predicted_speed + j - n
            shown[b, j] = episode.error[j] - decode_entry(row, scale, entry)
        for slot in range(told.shape[1]):
            told[b, slot] = decode_entry(row, scale, at.injection + slot) * form.bounds[slot] * resolution[slot]


@kernel
def _aim(
    form: Form,
    resolution: FloatArray,
    deviation: FloatArray,
    masks: BoolArray,
    views: View,
    works: BoolArray,
    margins: FloatArray,
    expected: FloatArray,
    left: FloatArray,
    actions: IntArray,
) -> None:
    """Fill the actions (B, S) that bring expected innovations (B, S) to the margins (B, S).

    `left` (B, S) is what rounding left over in the last step, and then in this one.
    """
    c, n, slots = unpack(Constants, form.constants, 0), form.matrices.step.shape[1] // 2, left.shape[1]
    new, wishes, levels = new_slots(form, n), np.empty(slots, np.int64), np.empty(slots, np.int64)
    for b in range(left.shape[0]):
        step = min(views.step[b], c.horizon - 1)
        for slot in range(slots):
            margin, half, level = margins[b, slot], resolution[slot] / 2.0, 0.0
            wanted = margin * deviation[step + 1, slot] - expected[b, slot] + left[b, slot]
            left[b, slot] = 0.0
            if views.attacked[b, slot] and works[b]:
                level = np.rint(wanted / resolution[slot])
                left[b, slot] = clip(wanted - level * resolution[slot], -half, half)
            wishes[slot] = int(level)
        open_slot, error = open_slots(form, borrowed(views.attacked)[b], new), borrowed(views.error)[b]
        say(
            form,
            c,
            error,
            open_slot,
            borrowed(masks)[b],
            borrowed(wishes),
            True,
            borrowed(actions)[b],
            borrowed(levels),
        )


def blind_tracker(spec: RoleSpec, **options: Any) -> Tracker:
    """Plays `tracker` without seeing the filter's prediction."""
    return Tracker(spec, **{"sight": False, **options})
