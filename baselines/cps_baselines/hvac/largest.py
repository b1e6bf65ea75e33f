"""A defender that believes the Kalman filter of the most sensors that agree with each other."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import FilterChoices, spread_after
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array


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
        up, down, spread, left = state
        r = np.where(self._filters.member, seen["innovation"], 0.0)
        up, down = np.maximum(up + r - self.kappa, 0.0), np.maximum(down - r - self.kappa, 0.0)
        spread = spread_after(spread, np.where(self._filters.member, r, 1.0))
        score = np.maximum(up, down).max(axis=2)
        alarm = (score > self.limit) | (spread < self.smooth).any(axis=2)
        left = np.where(alarm, self._release_steps, np.maximum(left - 1, 0))
        up, down = (np.where(alarm[:, :, np.newaxis], 0.0, sums) for sums in (up, down))
        rank = np.where(left > 0, -1.0, self._filters.size - np.minimum(score, self.limit) / (2.0 * self.limit))
        return self._filters.choices(rank.argmax(axis=1), seen), (up, down, spread, left)
