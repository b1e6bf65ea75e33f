"""A defender that keeps a two-sided CUSUM for each sensor and believes the Kalman filter of those that it trusts."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import FilterChoices, spread_after
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State


class Cusum(AnalyticPolicy):
    """Rejects a sensor when it drifts away from what the trusted ones predict, or when it has too little noise.

    With r the innovation of a sensor, in standard deviations, under the filter of the trusted sensors, the sums are
    S+ = max(0, S+ + r - kappa) and S- = max(0, S- - r - kappa) (Page 1954). Where one exceeds `limit`, the sensor with
    the largest sum is no longer trusted, and all sums start anew: the liar has moved those of the others. A sensor is
    trusted again when the mean of its innovations has stayed within `quiet` standard deviations for `release_h`. Nor is
    a sensor trusted while the mean square of its innovations is below `smooth`: honest ones have 1.

    Raises:
        ConfigurationError: a configuration without Kalman filters, or numbers that are not positive.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        kappa: float = 0.25,
        limit: float = 18.0,
        quiet: float = 0.4,
        release_h: float = 4.0,
        smooth: float = 0.35,
    ) -> None:
        super().__init__(spec)
        if min(kappa, limit, quiet, release_h) <= 0 or smooth < 0:
            raise ConfigurationError(
                f"kappa = {kappa}, limit = {limit}, quiet = {quiet}, release_h = {release_h}, smooth = {smooth}: all "
                "have to be positive, or smooth=0 for no such test"
            )
        self.kappa, self.limit, self.quiet, self.smooth = kappa, limit, quiet, smooth
        self._release_steps = round(3600.0 * release_h / spec.config.step_s)
        self._filters = FilterChoices(spec.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Sums up and down, whether a sensor is trusted, for how many steps it has been quiet, mean square; (B, S)."""
        shape = (len(generators), self.spec.config.num_sensors)
        return np.zeros(shape), np.zeros(shape), np.ones(shape, np.bool_), np.zeros(shape, np.int64), np.ones(shape)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        up, down, trusted, quiet, spread = state
        rows, own = np.arange(len(seen)), self._filters.index_of(trusted)
        r, mean = seen["innovation"][rows, own], seen["innovation_mean"][rows, own]
        up, down = np.maximum(up + r - self.kappa, 0.0), np.maximum(down - r - self.kappa, 0.0)
        spread = spread_after(spread, r)
        still = spread < self.smooth
        score = np.where(trusted, np.maximum(up, down), 0.0)
        worst = score.argmax(axis=1)
        alarm = score[rows, worst] > self.limit
        quiet = np.where(trusted | still | (np.abs(mean) > self.quiet), 0, quiet + 1)
        trusted = (trusted | (quiet >= self._release_steps)) & ~still
        trusted[rows[alarm], worst[alarm]] = False
        fresh = alarm[:, np.newaxis] | ~trusted
        up, down = np.where(fresh, 0.0, up), np.where(fresh, 0.0, down)
        choice = self._filters.choices(self._filters.index_of(trusted), seen)
        return choice, (up, down, trusted, quiet, spread)

    def beliefs(self, state: State) -> dict[str, Array]:
        """The larger sum of each sensor, and whether it is trusted."""
        return {"Sum of each sensor": np.maximum(state[0], state[1]), "Sensor trusted": state[2]}
