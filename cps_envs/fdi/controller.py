"""The controller of a vehicle, (3.6) and (3.7): it follows its front sensors and looks back at its follower."""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.fdi.state import Constants


@inlined
def feedback(error: FloatArray, c: Constants, i: int) -> float:
    """What vehicle i (0 = last) commands at the true error (2n,), m/s2: row i of A_2 e."""
    n = error.size // 2
    total = 0.0
    if i > 0:
        total -= c.proportional_gain * error[i - 1]
    total += c.proportional_gain * error[i]
    if i > 0:
        total -= c.derivative_gain * error[n + i - 1]
    return float(total + c.derivative_gain * error[n + i])


@inlined
def command(error: FloatArray, offset: FloatArray, c: Constants, i: int) -> float:
    """The same from readings that lie `offset` (2n,) off the true values, (3.15): u = A_2 e + B_a offset."""
    total = feedback(error, c, i) + c.proportional_gain * offset[i]
    return float(total + c.derivative_gain * offset[error.size // 2 + i])
