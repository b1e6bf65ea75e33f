"""A defender that believes the Kalman filter of the most sensors that agree with each other."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import MEMORY_STEPS, MOST, FilterChoices
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, State


class Largest(AnalyticPolicy):
    """Watches every filter by itself, and uses the largest set of sensors whose filter raised no alarm.

    Each filter has a two-sided CUSUM of the innovations r of each of its own sensors, S = max(0, S +- r - kappa), and
    their mean square. It raises an alarm where a sum exceeds `limit` or a mean square is below `smooth`; the alarm ends
    after `release_h` without a new one. Among sets of the same size it takes that with the smallest sum. A filter is
    only misled by its own sensors: one without a liar is right whatever the others have shown.

    Raises:
        ConfigurationError: a configuration without Kalman filters, or numbers that are not positive.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        kappa: float = 0.2,
        limit: float = 20.0,
        release_h: float = 8.0,
        smooth: float = 0.35,
    ) -> None:
        super().__init__(spec)
        if min(kappa, limit, release_h) <= 0 or smooth < 0:
            raise ConfigurationError(
                f"kappa = {kappa}, limit = {limit}, release_h = {release_h}, smooth = {smooth}: all have to be "
                "positive, or smooth=0 for no such test"
            )
        self.kappa, self.limit, self.smooth = kappa, limit, smooth
        self._release_steps = round(3600.0 * release_h / spec.config.step_s)
        self._filters = FilterChoices(spec.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Sums up and down and mean squares (B, F, S), and for how many steps each alarm goes on (B, F)."""
        shape = (len(generators), *self._filters.member.shape)
        return np.zeros(shape), np.zeros(shape), np.ones(shape), np.zeros(shape[:2], np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        following = tuple(np.empty_like(array) for array in state)
        index, numbers = np.empty(len(seen), np.int64), (self.kappa, self.limit, self.smooth, self._release_steps)
        watch(self._filters.member, self._filters.size, seen["innovation"], state, numbers, following, index)
        return self._filters.choices(index, seen), following


@kernel
def watch(
    member: BoolArray,
    size: IntArray,
    innovation: FloatArray,
    state: State,
    numbers: tuple[float, float, float, int],
    following: State,
    index: IntArray,
) -> None:
    """Fill the next state and the index (B,) of the chosen filter from innovations (B, F, S), see `Largest`."""
    (up, down, spread, left), (next_up, next_down, next_spread, next_left) = state, following
    kappa, limit, smooth, release_steps = numbers
    for b in range(len(index)):
        best = -np.inf
        for f in range(member.shape[0]):
            score, still = 0.0, False
            for s in range(member.shape[1]):
                r = innovation[b, f, s] if member[f, s] else 0.0
                square = min(r * r, MOST) if member[f, s] else 1.0
                next_up[b, f, s] = max(up[b, f, s] + r - kappa, 0.0)
                next_down[b, f, s] = max(down[b, f, s] - r - kappa, 0.0)
                next_spread[b, f, s] = spread[b, f, s] + (square - spread[b, f, s]) / MEMORY_STEPS
                score = max(score, next_up[b, f, s], next_down[b, f, s])
                still |= next_spread[b, f, s] < smooth
            next_left[b, f] = max(left[b, f] - 1, 0)
            if score > limit or still:
                next_left[b, f] = release_steps
                for s in range(member.shape[1]):
                    next_up[b, f, s] = next_down[b, f, s] = 0.0
            rank = -1.0 if next_left[b, f] > 0 else size[f] - min(score, limit) / (2.0 * limit)
            if rank > best:
                best, index[b] = rank, f
