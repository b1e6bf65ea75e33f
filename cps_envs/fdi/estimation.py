"""The platoon's Kalman filter: it predicts every gap and speed from the readings that the defender trusts.

It knows the commands and the size of the disturbances, and nothing of an attack. Commands are held over a step.
"""

from __future__ import annotations

import math

from cps_envs.core.compute.kalman import take_in
from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.core.types import FloatArray
from cps_envs.fdi.legality import resolution
from cps_envs.fdi.state import Constants, Matrices, State, add_product

LEAST_DEVIATION = 1e-3  # m and m/s, of a reading; a filter needs some


@inlined
def state_of(reading: int, n: int, readings: int) -> int:
    """Which error (0 to 2n - 1) a reading shows: fronts 1..n, then the rears of 2..n, which see the gap behind."""
    place = reading % (readings // 2)
    pair = place if place < n else place - n
    return pair if reading < readings // 2 else n + pair


@inlined
def measure(episode: State, c: Constants) -> None:
    """Take the readings of now: truth and noise, rounded to the resolution where that is so, and the injections."""
    n, noise = episode.command.size, episode.noise[episode.step[0]]
    for j in range(c.readings):
        ranges = j < c.readings // 2
        offset = c.desired_gap_m if ranges else 0.0  # sensors measure the gap, not its error
        honest = episode.error[state_of(j, n, c.readings)] + offset
        honest += episode.deviation[j] * noise[j]
        if c.quantised:
            step = resolution(c, j, c.readings // 2)
            honest = step * math.floor(honest / step + 0.5)
        told = honest + episode.injection[j]
        if ranges and c.limit_readings:
            told = max(told, 0.0)
        episode.reading[j] = told - offset


@inlined
def variance_of(reading: int, noise: float, c: Constants) -> float:
    """Of an honest reading, m2 or m2/s2: its noise, of this deviation, and the rounding."""
    step = resolution(c, reading, c.readings // 2) if c.quantised else 0.0
    return max(noise * noise + step * step / 12.0, LEAST_DEVIATION * LEAST_DEVIATION)


@inlined
def deviation_of(episode: State, c: Constants, reading: int) -> float:
    """How far an honest reading lies off its prediction, one standard deviation, m or m/s."""
    state = state_of(reading, episode.command.size, c.readings)
    return math.sqrt(episode.covariance[state, state] + variance_of(reading, episode.deviation[reading], c))


@inlined
def innovation_of(episode: State, c: Constants, reading: int) -> float:
    """A reading minus its prediction, m or m/s."""
    return float(episode.reading[reading] - episode.prediction[state_of(reading, episode.command.size, c.readings)])


@inlined
def update(episode: State, c: Constants, column: FloatArray) -> None:
    """Turn the prediction into the estimate of now by the readings that are trusted; `column` (2n,) is scratch."""
    covariance = episode.covariance
    for j in range(c.readings):
        if episode.trust[j] == 0:
            continue
        state = state_of(j, episode.command.size, c.readings)
        copy(covariance[state], column)
        innovation, total = innovation_of(episode, c, j), column[state] + variance_of(j, episode.deviation[j], c)
        take_in(episode.prediction, covariance, column, column, innovation, total)


@inlined
def substitute(episode: State, c: Constants) -> None:
    """What the vehicles use: the readings that are trusted, and the estimate in the place of the others."""
    for j in range(c.readings):
        estimate = episode.prediction[state_of(j, episode.command.size, c.readings)]
        episode.used[j] = episode.reading[j] if episode.trust[j] != 0 else estimate


@inlined
def command_used(episode: State, c: Constants, i: int) -> float:
    """The command (3.15) of vehicle i (0 = last), m/s2, from what it uses of its front and its rear sensors."""
    n, half = episode.command.size, c.readings // 2
    total = c.proportional_gain * episode.used[i] + c.derivative_gain * episode.used[half + i]
    if i > 0:
        total -= c.proportional_gain * episode.used[n + i - 1] + c.derivative_gain * episode.used[half + n + i - 1]
    return float(total)


@inlined
def extrapolate(episode: State, c: Constants, m: Matrices, before: FloatArray) -> None:
    """Turn the estimate of now into the prediction of the next step; `before` (2n,) is scratch."""
    n, covariance = episode.command.size, episode.covariance
    copy(episode.prediction, before)
    fill(episode.prediction, 0.0)
    add_product(m.hold, 0, before, episode.prediction)
    add_product(m.hold, 2 * n, episode.command, episode.prediction)
    for i in range(n):
        for k in range(2 * n):
            covariance[i, k] += c.dt_s * covariance[n + i, k]
    for i in range(2 * n):
        for k in range(n):
            covariance[i, k] += c.dt_s * covariance[i, n + k]
    for i in range(2 * n):
        for k in range(2 * n):
            covariance[i, k] += m.spread[i, k]


@inlined
def start_filter(episode: State, c: Constants) -> None:
    """Know of the beginning no more than how it is drawn: uniformly around the steady state."""
    n = episode.command.size
    fill(episode.prediction, 0.0)
    for i in range(2 * n):
        fill(episode.covariance[i], 0.0)
        spread = c.gap_spread_m if i < n else c.speed_spread_mps
        episode.covariance[i, i] = spread * spread / 3.0
