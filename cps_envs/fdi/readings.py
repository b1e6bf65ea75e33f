"""What the sensors report, what the attacker adds to it, and what the defender puts in the place of a reading."""

from __future__ import annotations

from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.legality import resolution
from cps_envs.fdi.state import Constants, Matrices, State, add_product


@inlined
def inject(injection: FloatArray, c: Constants, sensors: IntArray, level: IntArray) -> None:
    """The injections (R,) of all readings, m or m/s, from the levels of the attacked sensors."""
    fill(injection, 0.0)
    for slot in range(sensors.size):
        if sensors[slot] >= 0:
            injection[sensors[slot]] = level[slot] * resolution(c, sensors[slot], injection.size // 2)


@inlined
def read_defense(action: IntArray, c: Constants, trust: FloatArray, correction: FloatArray) -> None:
    """Trust (R,) and corrections (n,) in m/s2 of a defender's action (R + n,)."""
    for j in range(trust.size):
        trust[j] = action[j]
    for i in range(correction.size):
        correction[i] = (action[trust.size + i] - c.correction_levels) * c.correction_step_mps2


@inlined
def predict(episode: State, c: Constants, m: Matrices, trust: FloatArray, estimate: FloatArray) -> None:
    """Renew the model's prediction of the true values from the readings of the last step.

    `trust` (2n,) is what the defender thinks of those readings after having seen them: an untrusted one is left out,
    and the rear sensor of the vehicle ahead, or else the prediction that was made for it, takes its place. `estimate`
    (2n,) is scratch.
    """
    n = episode.command.size
    if episode.step[0] == 0:
        copy(episode.error, episode.prediction)
        return
    for j in range(2 * n):
        estimate[j] = episode.reading[j]
        if trust[j] == 0:
            estimate[j] = episode.rear[j] if has_rear_sensor(j, n) else episode.prediction[j]
    fill(episode.prediction, 0.0)
    if c.holds:
        add_product(m.hold, 0, estimate, episode.prediction)
        add_product(m.hold, 2 * n, episode.command, episode.prediction)
    else:  # inside the step the commands follow the true values, offset by what the sensors said at its start
        add_product(m.step, 0, estimate, episode.prediction)
        add_product(m.step, 4 * n, episode.correction, episode.prediction)
        for j in range(2 * n):
            estimate[j] = episode.used[j] - estimate[j]
        add_product(m.step, 2 * n, estimate, episode.prediction)


@inlined
def has_rear_sensor(reading: int, n: int) -> bool:
    """Whether the vehicle ahead measures the same range; the lead has nobody ahead."""
    return reading < n - 1


@inlined
def sense(episode: State, c: Constants, trust: FloatArray, offset: FloatArray) -> None:
    """Take the readings, replace the untrusted ones, and fill the offsets (2n,) of what is used from the truth."""
    n, first = episode.command.size, episode.step[0] == 0
    for i in range(n):
        before, rate_before = episode.reading[i], episode.reading[n + i]
        now = episode.error[i] + episode.injection[i]
        rate = episode.error[n + i] + episode.injection[n + i]
        episode.residual[i] = 0.0 if first else now - before - c.dt_s / 2 * (rate_before + rate)
        episode.rear[i] = episode.error[i]
    for j in range(2 * n):
        episode.reading[j] = episode.error[j] + episode.injection[j]
        episode.trust[j] = trust[j]
        offset[j] = episode.injection[j]
        if trust[j] == 0:
            offset[j] = 0.0 if has_rear_sensor(j, n) else episode.prediction[j] - episode.error[j]
        episode.used[j] = episode.error[j] + offset[j]
