"""Who plays preset `learning` of the HVAC problem: attackers, defenders and constants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role
from tools.rivals import Rivals

NOISY_ROOT = "ramp?rate_c_per_h=0.6&exponent=0.5&keep_noise=true"
SIGNED = {  # attackers that show colder or, with another option, warmer zones: name -> reference
    **{name: name for name in ("ramp", "root_ramp", "mimic", "brink", "tracker")},
    **{f"noisy_{name}": f"{name}?keep_noise=true" for name in ("ramp", "mimic")},
    "noisy_root": NOISY_ROOT,
}
READINGS = tuple(value / 6.0 for value in range(-6, 7))  # 10 to 40 C in steps of 2.5 C, in shares of the sensor range
BIASES_C = (1.0, 2.0, 3.0, 5.0, 8.0, 15.0)
HALF_RANGE_C, SENSORS, CHOICES = 15.0, 4, 32  # of preset `learning`


def _signed() -> Iterator[Contestant]:
    for name, policy in SIGNED.items():
        joint = "&" if "?" in policy else "?"
        yield Contestant(name, policy=policy)
        yield Contestant(f"{name}_warm", policy=f"{policy}{joint}warmer=true")


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


RIVALS: Mapping[Role, Rivals] = {
    "attacker": Rivals(
        policies=(
            *(Contestant(name) for name in ("none", "constant", "sine", "random")),
            Contestant("constant_28", policy="constant?reading_c=28", title="constant, 28 C"),
            Contestant("constant_40", policy="constant?reading_c=40", title="constant, 40 C"),
            *_signed(),
            Contestant("warm_tracker"),
            Contestant("warm_tracker_start", "warm_tracker?untrained=true"),
        ),
        constants=tuple(_forged()),
    ),
    "defender": Rivals(
        policies=(
            *map(Contestant, ("none", "fixed", "mtd1", "mtd2", "model_only", "largest", "cusum")),
            Contestant("bayes"),
            Contestant("bayes_start", "bayes?untrained=true"),
        ),
        constants=tuple(f"always?action={choice}" for choice in range(CHOICES)),
        informed=(Contestant("lookahead"), Contestant("informed"), Contestant("truth")),
    ),
}
