"""One step of one episode: what the sensors report, what the vehicles command, where that takes the platoon."""

from __future__ import annotations

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.fdi.legality import SLACK, inside
from cps_envs.fdi.memory import Constants, Matrices, Memory, add_product, assign, fill


@inlined
def command(m: Memory, matrices: Matrices, offset: FloatArray) -> None:
    """The commands (3.15), u = A_2 e + B_a offset, from the offsets (2n,) of what is used from the true values."""
    assign(m.command, m.law)
    add_product(matrices.law, 2 * m.law.size, offset, m.command)


@inlined
def within_limits(m: Memory, c: Constants) -> bool:
    """Whether injection and command satisfy (3.49) for every vehicle and (3.50); (3.48) holds by construction."""
    lowest = -c.desired_gap_m - SLACK
    for i in range(m.law.size):
        if c.limit_commands > 0 and not inside(m.command[i], c):
            return False
        if c.limit_readings > 0 and m.injection[i] != 0 and m.error[i] + m.injection[i] < lowest:
            return False
    return True


@inlined
def predict(m: Memory, c: Constants, matrices: Matrices, trust: FloatArray, first: bool, estimate: FloatArray) -> None:
    """Renew the model's prediction of the true values from the readings of the last step.

    `trust` (2n,) is what the defender thinks of those readings after having seen them: an untrusted one is left out,
    and the rear sensor of the vehicle ahead, or else the prediction that was made for it, takes its place. `estimate`
    (2n,) is scratch.
    """
    n = m.law.size
    if first:
        assign(m.prediction, m.error)
        return
    for j in range(2 * n):
        estimate[j] = m.reading[j]
        if trust[j] == 0:
            estimate[j] = m.rear[j] if has_rear_sensor(j, n, c) else m.prediction[j]
    fill(m.prediction, 0.0)
    if c.clip > 0:
        add_product(matrices.hold, 0, estimate, m.prediction)
        add_product(matrices.hold, 2 * n, m.command, m.prediction)
    else:  # inside the step the commands follow the true values, offset by what the sensors said at its start
        add_product(matrices.step, 0, estimate, m.prediction)
        add_product(matrices.step, 4 * n, m.correction, m.prediction)
        for j in range(2 * n):
            estimate[j] = m.used[j] - estimate[j]
        add_product(matrices.step, 2 * n, estimate, m.prediction)


@inlined
def has_rear_sensor(reading: int, n: int, c: Constants) -> bool:
    """Whether the vehicle ahead measures the same range and shares it; the lead has nobody ahead."""
    return reading < n - 1 and c.share_rear_range > 0


@inlined
def sense(m: Memory, c: Constants, trust: FloatArray, first: bool, offset: FloatArray) -> None:
    """Take the readings, replace the untrusted ones, and fill the offsets (2n,) of what is used from the truth."""
    n = m.law.size
    for i in range(n):
        before, rate_before = m.reading[i], m.reading[n + i]
        now, rate = m.error[i] + m.injection[i], m.error[n + i] + m.injection[n + i]
        m.residual[i] = 0.0 if first else now - before - c.dt_s / 2 * (rate_before + rate)
        m.rear[i] = m.error[i]
    for j in range(2 * n):
        m.reading[j] = m.error[j] + m.injection[j]
        m.trust[j] = trust[j]
        offset[j] = m.injection[j]
        if trust[j] == 0:
            offset[j] = 0.0 if has_rear_sensor(j, n, c) else m.prediction[j] - m.error[j]
        m.used[j] = m.error[j] + offset[j]


@inlined
def correct(m: Memory, c: Constants, correction: FloatArray) -> None:
    """Add the defender's corrections (n,) in m/s2 as far as the limits leave room, and clip where limits clip."""
    for i in range(m.law.size):
        wanted = m.command[i] + correction[i]
        m.command[i], m.correction[i] = wanted, correction[i]
        if c.limit_commands > 0 and (c.clip > 0 or correction[i] != 0):
            m.command[i] = min(max(wanted, c.min_acceleration_mps2), c.max_acceleration_mps2)
            if c.clip == 0:
                m.correction[i] += m.command[i] - wanted


@inlined
def move(
    m: Memory,
    c: Constants,
    matrices: Matrices,
    offset: FloatArray,
    disturbances: FloatArray,
    step: int,
    state: FloatArray,
) -> None:
    """One step of the errors: the closed loop (3.16), or with clipped limits held commands; plus disturbances.

    `disturbances` holds accelerations (horizon, n) in m/s2 that nobody commanded, or nothing; `state` (2n,) is scratch.
    """
    n = m.law.size
    assign(state, m.error)
    fill(m.error, 0.0)
    if c.clip > 0:
        add_product(matrices.hold, 0, state, m.error)
        add_product(matrices.hold, 2 * n, m.command, m.error)
    else:
        add_product(matrices.step, 0, state, m.error)
        add_product(matrices.step, 2 * n, offset, m.error)
        add_product(matrices.step, 4 * n, m.correction, m.error)
    if disturbances.shape[0] > 0:
        add_product(matrices.hold, 2 * n, disturbances[step], m.error)
