"""A small network beside a controller of a string: it changes a vehicle's command by no more than a bound.

One network for all vehicles, with the signals that the controller has.
"""

from __future__ import annotations

from cps_envs.core.kernels import clip, inlined
from cps_envs.core.types import FloatArray

BOUND_MPS2 = 1.0  # chosen: a sixth of what a correction may be
REACH = 2.5  # scaled signals lie within +- this
SIGNALS = {  # of a vehicle, with what one unit of the network's input stands for
    "excess": 4.0,  # m, of the gap over the wanted one
    "closing": 3.0,  # m/s, the predecessor's speed minus the own
    "speed": 15.0,  # m/s, over half of the desired one
    "acceleration": 2.0,  # m/s2
    "predecessor": 2.0,  # m/s2, its acceleration
    "predecessor_command": 3.0,  # m/s2
    "lag": 0.2,  # s, tau over MIDDLE_LAG_S
    "leads": 1.0,  # 1 for the leader of a platoon, else -1
    "ahead_closing": 5.0,  # m/s, the disbanded vehicle's speed minus the own; these three are 0 where nobody is told
    "ahead_acceleration": 2.0,  # m/s2, of that vehicle
    "ahead_command": 3.0,  # m/s2, of that vehicle
}
SCALE = tuple(SIGNALS.values())
COUNT = len(SCALE)
WIDTH = COUNT + 2  # numbers of a unit: the weights of the signals, its bias, and what it counts in the sum
MIDDLE_LAG_S = 0.3


@inlined
def scaled(value: float, scale: float) -> float:
    """An input of the network."""
    return clip(value / scale, -REACH, REACH)


@inlined
def squashed(value: float) -> float:
    """Softsign: between -1 and 1, steepest at 0."""
    return value / (1.0 + abs(value))


@inlined
def activation(inputs: tuple[float, ...], weights: FloatArray, first: int) -> float:
    """What a unit sums up, whose numbers begin at `first`."""
    total = weights[first + COUNT]
    for i in range(COUNT):
        total += weights[first + i] * inputs[i]
    return float(total)


@inlined
def residual(inputs: tuple[float, ...], weights: FloatArray) -> float:
    """What the network adds to a command (m/s2); `inputs` are scaled signals, `weights` (units * WIDTH,)."""
    total = 0.0
    for first in range(0, weights.size, WIDTH):
        total += weights[first + COUNT + 1] * squashed(activation(inputs, weights, first))
    return BOUND_MPS2 * squashed(total)
