"""The step that Kalman filters of several problems share: they take in readings one after the other."""

from __future__ import annotations

from typing import Any

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import FloatArray


@inlined
def take_in(
    estimate: FloatArray, covariance: FloatArray, column: Any, row: Any, innovation: float, total: float
) -> None:
    """Correct an estimate (k,) and its covariance (k, k) by a reading of one of its numbers.

    `column` and `row`, arrays or tuples of k, are copies of that number's column and row of the covariance: they are
    equal but for rounding. `innovation` is the reading minus its prediction, and `total` the variance of that.
    """
    for i in range(len(row)):
        gain = column[i] / total
        estimate[i] += gain * innovation
        for k in range(len(row)):
            covariance[i, k] -= gain * row[k]
