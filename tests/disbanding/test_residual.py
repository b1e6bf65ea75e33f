"""The network beside a searched controller: what it changes, by how much, and its gradients through the string."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding import families, residual_families
from cps_baselines.disbanding.residual import BOUND_MPS2, COUNT, WIDTH, pull_residual, residual
from cps_baselines.disbanding.string_gradient import differentiate
from cps_baselines.family import Family, play_family
from cps_envs.core.errors import ConfigurationError
from cps_envs.disbanding.problem import DISBANDING

SHORT: dict[str, Any] = {"num_platoons": 4, "vehicles_per_platoon": 4, "duration_s": 40.0, "report": "safety"}
CASES = {
    "one attack": ("paper", {"tau_s": 0.3}, "lead"),
    "two attacks, a driver late": ("easy", {"attack_budget": 2}, "timed?pause_s=8"),
    "noise": ("easy", {"correction_noise_mps2": 0.5, "tau_s": 0.5}, "lead"),
}
PAIRS = [(residual_families.BROADCAST, families.BROADCAST), (residual_families.LOCAL, families.LOCAL)]
SLOPES = {"return": np.ones(1), "smallest_gap_m": np.full(1, -0.3)}


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


def test_the_gradient_of_the_network_alone() -> None:
    generator = np.random.default_rng(1)
    weights, inputs = generator.standard_normal(3 * WIDTH), tuple(generator.uniform(-2.0, 2.0, COUNT))
    gradient, by = np.zeros(weights.size), np.zeros(COUNT)
    pull_residual(inputs, weights, 2.0, gradient, by)
    for place in range(weights.size):
        move = 1e-6 * (np.arange(weights.size) == place)
        slope = (residual(inputs, weights + move) - residual(inputs, weights - move)) / 2e-6
        assert gradient[place] == pytest.approx(2.0 * slope, abs=1e-7)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("family", [pair[0] for pair in PAIRS], ids=["broadcast", "local"])
def test_gradients_are_those_of_differences(family: Family, case: str) -> None:
    """Long moves may cross a jump, and short ones drown in the float32 of observations: one length has to agree."""
    config, attacker = config_of(case)
    here, ways = points(family, 1, 0.2), points(family, 4, 1.0)
    assert family.gradients is not None
    outcome, found = family.gradients(config, family.values(here), attacker, [1], lambda outcome: SLOPES)

    def paid(moved: np.ndarray) -> np.ndarray:
        ends = play_family(family, DISBANDING, config, attacker, family.values(moved), [1] * len(moved))
        return ends["return"] - 0.3 * ends["smallest_gap_m"]

    assert outcome["return"] - 0.3 * outcome["smallest_gap_m"] == pytest.approx(paid(here), abs=1e-12)
    slopes = family.by_steps(family.values(here), found)[0] @ ways.T
    sizes = np.array([1e-4, 3e-5, 1e-5, 3e-6])[:, np.newaxis]
    differences = np.array([(paid(here + size * ways) - paid(here - size * ways)) / (2 * size) for size in sizes])
    errors = np.abs(differences - slopes).min(axis=0)
    assert errors.max() < 0.03 * np.abs(slopes).max()


@pytest.mark.parametrize(
    "overrides",
    [{"interpretation": "S1"}, {"on_collision": "end"}, {"payoff_set": "intact_now"}, {"report": "chapter"}],
)
def test_what_has_no_gradient_is_refused(overrides: dict[str, Any]) -> None:
    config = DISBANDING.config("paper", {**SHORT, **overrides})
    family = residual_families.LOCAL
    policy = family.build(DISBANDING.game(config, 1).spec("defender"), family.values(points(family, 1, 0.0)))
    with pytest.raises(ConfigurationError, match="gradients need"):
        differentiate(config, policy, "lead", [0], lambda outcome: SLOPES)  # type: ignore[arg-type]
