"""The longest integration step with which the sliding mode is stable (specification 4.2)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import cos, pi

import numpy as np


def longest_stable_step_s(
    num_vehicles: int, seized: Iterable[Sequence[int]], gain_per_s: float, *, disguised: bool
) -> float:
    """2 / (gain * lambda): below it explicit Euler follows the combined controller inside its boundary layer.

    lambda is the largest eigenvalue of the coupling K in e_front + e_rear = -K x of the vehicles that drive by the
    sliding mode. K is tridiagonal, 2 and -1, with 1 for the rear vehicle, which has one neighbour. Seized vehicles cut
    the platoon; the maximum is taken over all places (1 = rear) that they may have together, and over the whole
    platoon if they are `disguised`, driving by the same law before the onset.
    """
    blocks: list[float] = []
    for places in seized:
        blocks += [largest_behind(places[0] - 1), largest_ahead(num_vehicles - places[-1])]
        blocks += [largest_ahead(ahead - behind - 1) for behind, ahead in pairwise(places)]
    if disguised:
        blocks.append(largest_behind(num_vehicles))
    return 2.0 / (gain_per_s * max(blocks))


def largest_behind(count: int) -> float:
    """The largest eigenvalue of K for the rear `count` vehicles, of which the last has nobody behind."""
    return 2.0 - 2.0 * cos((2 * count - 1) * pi / (2 * count + 1)) if count else 0.0


def largest_ahead(count: int) -> float:
    """The largest eigenvalue of K for `count` vehicles that have a neighbour on either side."""
    return 2.0 - 2.0 * cos(count * pi / (count + 1))


def linear_radius(num_vehicles: int, proportional_gain: float, derivative_gain: float, dt_s: float) -> float:
    """The spectral radius of a platoon that drives by (5.15), in steps of dt_s: below 1 errors die out.

    The slowest and the fastest mode of K decide, each a pair of place and speed in semi-implicit Euler steps.
    """
    slowest, fastest = 2.0 - 2.0 * cos(pi / (2 * num_vehicles + 1)), largest_behind(num_vehicles)
    radii = []
    for coupling in (slowest, fastest):
        k, d = dt_s * coupling * proportional_gain, 1.0 - dt_s * coupling * derivative_gain
        radii.append(float(np.abs(np.linalg.eigvals([[1.0 - dt_s * k, dt_s * d], [-k, d]])).max()))
    return max(radii)
