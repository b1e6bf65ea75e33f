"""Policies of the HVAC problem that take one action."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cps_envs.core.types import Role

READINGS = tuple(value / 6.0 for value in range(-6, 7))  # 10 to 40 C in steps of 2.5 C, in shares of the sensor range
BIASES_C = (1.0, 2.0, 3.0, 5.0, 8.0, 15.0)
HALF_RANGE_C, SENSORS, CHOICES = 15.0, 4, 32  # of preset `learning`


def _forged() -> Iterator[str]:
    """Every sensor reads the same all day, is off by the same, or reads an end of the range."""
    for reading in READINGS:
        yield _action([reading] * SENSORS, 1.0)
    for base in (-1.0, 0.0):
        for bias_c in BIASES_C:
            for sign in (-1.0, 1.0):
                yield _action([sign * bias_c / HALF_RANGE_C] * SENSORS, base)
    for corner in range(1, 2**SENSORS - 1):
        yield _action([1.0 if corner >> s & 1 else -1.0 for s in range(SENSORS)], 1.0)


def _action(shares: list[float], base: float) -> str:
    numbers = ",".join(f"{value:.6g}" for value in (*shares, base))
    return f"always?action=[{numbers}]"


CONSTANTS: Mapping[Role, tuple[str, ...]] = {
    "attacker": tuple(_forged()),
    "defender": tuple(f"always?action={choice}" for choice in range(CHOICES)),
}
