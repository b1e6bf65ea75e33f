"""How much noise readings have: forged ones without any are smoother than a sensor can be."""

from __future__ import annotations

from cps_envs.core.types import FloatArray

MEMORY_STEPS = 30.0  # of the mean square: an hour
MOST = 9.0  # of a square, so that one large innovation is forgotten within hours


def spread_after(spread: FloatArray, innovation: FloatArray) -> FloatArray:
    """The exponentially weighted mean square of innovations in standard deviations, any shape, with the newest one.

    That of an honest sensor is 1 +- 0.18; below 0.35 it is seldom.
    """
    square = innovation * innovation
    square[square > MOST] = MOST
    renewed: FloatArray = spread + (square - spread) / MEMORY_STEPS
    return renewed
