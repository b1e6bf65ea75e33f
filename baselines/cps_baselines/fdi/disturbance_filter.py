"""Kalman filters that also estimate each vehicle's disturbance, which lasts for a while."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.bank import honest_sets
from cps_baselines.fdi.platoon_filter import platoon_filter
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig

LEAST_MPS2 = 1e-3  # of a disturbance, in a platoon that has none
DRIFT_MPS2 = 0.3  # chosen: deviation of the acceleration that a lie about the lead's gap may pretend


class HypothesisFilters(NamedTuple):
    """K filters, one for each hypothesis; the first one takes every sensor for honest. Shared and read only.

    Their states (3n + 1,) are the platoon's errors (2n,), the disturbance of each vehicle (n,) in m/s2, and a lasting
    acceleration of the whole platoon, which shows in the lead's gap only and is zero but for the last hypothesis.
    Nobody knows when a disturbance changes: of one that lasts k steps a share of 1 / k is forgotten in each.
    Readings are taken in one after the other, so the innovations of a step are independent.
    """

    trusted: BoolArray  # (K, R) which sensors a hypothesis takes for honest
    heard: BoolArray  # (K, R) which sensors its filter takes in
    gains: FloatArray  # (horizon + 1, K, R, 3n + 1)
    precisions: FloatArray  # (horizon + 1, K, R) one over the innovations' deviations
    surprise: FloatArray  # (horizon + 1, K) how much wider the innovations may lie than the first filter's, in nats
    lasts: FloatArray  # (3n + 1, 3n + 1) the state of the next step from this one
    start: FloatArray  # (K, 3n + 1, 3n + 1) covariances


@lru_cache(maxsize=8)
def hypothesis_filters(config: FdiConfig) -> HypothesisFilters:
    """The filters of a configuration: all sensors, all but each group of one gap, all with a drift of the lead's gap.

    Nobody can check the sensors of the lead's gap against others. Their lies, if they agree, look like a disturbance
    that accelerates every vehicle alike and does not end. The last hypothesis allows that, and trusts neither sensor.

    Raises:
        ConfigurationError: the configuration has no filter.
    """
    law, n = platoon_filter(config), config.num_vehicles
    sets = honest_sets(config)
    of_lead = law.view.argmax(axis=1) % n == n - 1
    heard = np.concatenate([sets, np.ones((1, len(of_lead)), np.bool_)])
    trusted = np.concatenate([sets, ~of_lead[np.newaxis]])
    low, high = bounds(config.disturbance_mps2)
    variance = max((low**2 + low * high + high**2) / 3, LEAST_MPS2**2)  # of a deviation that is drawn evenly
    start = np.zeros((len(heard), 3 * n + 1, 3 * n + 1))
    start[:, : 2 * n, : 2 * n] = law.start
    start[:, 2 * n : 3 * n, 2 * n : 3 * n] = variance * np.eye(n)
    start[-1, -1, -1] = DRIFT_MPS2**2
    lasts = np.eye(3 * n + 1)
    lasts[: 2 * n, : 2 * n] = law.coast
    lasts[: 2 * n, 2 * n : 3 * n] = law.command
    kept = 1 - 1 / config.hold_steps  # the correlation of a disturbance and that of the next step
    lasts[2 * n : 3 * n, 2 * n : 3 * n] = kept * np.eye(n)
    fresh = np.zeros(3 * n + 1)
    fresh[2 * n : 3 * n] = (1 - kept**2) * variance
    lasts[: 2 * n, -1] = law.command.sum(axis=1)
    gains = np.zeros((config.horizon + 1, *heard.shape, 3 * n + 1))
    precisions, surprise = np.zeros(gains.shape[:3]), np.zeros(gains.shape[:2])
    _fill(heard, lasts, fresh, start, law.view.argmax(axis=1), law.noise, gains, precisions, surprise)
    return HypothesisFilters(trusted, heard, gains, precisions, surprise, lasts, start)


@kernel
def _fill(
    heard: BoolArray,
    lasts: FloatArray,
    fresh: FloatArray,
    start: FloatArray,
    state: IntArray,
    noise: FloatArray,
    gains: FloatArray,
    precisions: FloatArray,
    surprise: FloatArray,
) -> None:
    """Fill the last three arrays.

    `fresh` (3n + 1,) are variances that each step adds; `state` (R,) is the error that a reading shows, and `noise`
    (R,) its variances.
    """
    size = lasts.shape[0]
    for k in range(heard.shape[0]):
        covariance = start[k].copy()
        for step in range(gains.shape[0]):
            if step > 0:
                covariance = lasts @ covariance @ lasts.T + np.diag(fresh)
            for j in range(heard.shape[1]):
                variance = covariance[state[j], state[j]] + noise[j]
                precisions[step, k, j] = 1 / np.sqrt(variance)
                if heard[k, j]:
                    surprise[step, k] += np.log(precisions[step, 0, j] / precisions[step, k, j])
                    gain = covariance[:, state[j]] / variance
                    gains[step, k, j] = gain
                    for i in range(size):
                        for m in range(size):
                            covariance[i, m] -= gain[i] * gain[m] * variance
