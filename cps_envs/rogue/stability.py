"""The longest integration step with which the sliding mode is stable (specification 4.2)."""

from __future__ import annotations

from math import cos, pi


def longest_stable_step_s(num_vehicles: int, seized: range, gain_per_s: float, *, disguised: bool) -> float:
    """2 / (gain * lambda): below it explicit Euler follows the combined controller inside its boundary layer.

    lambda is the largest eigenvalue of the coupling K in e_front + e_rear = -K x of the vehicles that drive by the
    sliding mode. K is tridiagonal, 2 and -1, with 1 for the rear vehicle, which has one neighbour. A seized vehicle
    cuts the platoon in two; the maximum is taken over all places `seized` (1 = rear) that it may have, and over the
    whole platoon if the seized vehicle is `disguised`, driving by the same law before its onset.
    """
    blocks = [largest_behind(place - 1) for place in seized] + [largest_ahead(num_vehicles - place) for place in seized]
    if disguised:
        blocks.append(largest_behind(num_vehicles))
    return 2.0 / (gain_per_s * max(blocks))


def largest_behind(count: int) -> float:
    """The largest eigenvalue of K for the rear `count` vehicles, of which the last has nobody behind."""
    return 2.0 - 2.0 * cos((2 * count - 1) * pi / (2 * count + 1)) if count else 0.0


def largest_ahead(count: int) -> float:
    """The largest eigenvalue of K for `count` vehicles that have a neighbour on either side."""
    return 2.0 - 2.0 * cos(count * pi / (count + 1))
