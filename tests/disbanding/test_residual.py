"""The network beside a searched controller: what it changes, and by how much."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding import families, residual_families
from cps_baselines.disbanding.residual import BOUND_MPS2, COUNT, WIDTH, residual
from cps_baselines.family import Family, play_family
from cps_envs.disbanding.problem import DISBANDING

SHORT: dict[str, Any] = {"num_platoons": 4, "vehicles_per_platoon": 4, "duration_s": 40.0, "report": "safety"}
CASES: dict[str, tuple[str, dict[str, Any], str]] = {
    "one attack": ("paper", {"tau_s": 0.3}, "lead"),
    "two attacks, a driver late": ("easy", {"attack_budget": 2}, "timed?pause_s=8"),
    "noise": ("easy", {"correction_noise_mps2": 0.5, "tau_s": 0.5}, "lead"),
}
PAIRS = [(residual_families.BROADCAST, families.BROADCAST), (residual_families.LOCAL, families.LOCAL)]


def config_of(case: str) -> tuple[Any, str]:
    preset, overrides, attacker = CASES[case]
    return DISBANDING.config(preset, {**SHORT, **overrides}), attacker


def points(family: Family, count: int, size: float) -> np.ndarray:
    return size * np.random.default_rng(3).standard_normal((count, int(family.free.sum())))


@pytest.mark.parametrize(("family", "base"), PAIRS)
def test_at_the_start_the_network_changes_nothing(family: Family, base: Family) -> None:
    config, attacker = config_of("two attacks, a driver late")
    plain = play_family(base, DISBANDING, config, attacker, base.values(np.zeros((2, len(base.numbers)))), [1, 2])
    start = family.values(points(family, 2, 0.0))
    beside = play_family(family, DISBANDING, config, attacker, start, [1, 2])
    for name, values in plain.items():
        np.testing.assert_array_equal(beside[name], values, err_msg=name)


def test_the_network_stays_within_its_bound() -> None:
    generator = np.random.default_rng(0)
    for size in (0.1, 1.0, 1e6):
        weights, inputs = size * generator.standard_normal(5 * WIDTH), tuple(generator.uniform(-2.5, 2.5, COUNT))
        assert 0 < abs(residual(inputs, weights)) <= BOUND_MPS2


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("family", [pair[0] for pair in PAIRS], ids=["broadcast", "local"])
def test_the_network_plays_the_same_in_the_loop_and_in_a_match(family: Family, case: str) -> None:
    config, attacker = config_of(case)
    values, start = (family.values(points(family, 3, size)) for size in (1.0, 0.0))
    looped = play_family(family, DISBANDING, config, attacker, values, [1, 2, 3])
    match = play_family(replace(family, loop=None), DISBANDING, config, attacker, values, [1, 2, 3])
    for name, found in match.items():
        np.testing.assert_allclose(looped[name], found, rtol=0, atol=1e-12, err_msg=name)
    alone = play_family(family, DISBANDING, config, attacker, start, [1, 2, 3])
    assert not np.any(looped["return"] == alone["return"])
