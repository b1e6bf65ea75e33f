"""The string controller in one kernel, beside a match, and the stability of strings with the published gains."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from cps_baselines.disbanding.string_controller import SHAPE, StringController, StringLoop, shipped_gains
from cps_envs.core.play import play_episodes
from cps_envs.disbanding.problem import DISBANDING
from cps_paper.disbanding.string_stability import peak_gain, platoon_matrices, rear_to_rear_gain
from cps_paper.disbanding.strings import Stability, analyse

ONE, TWO, THREE = "lead", "table_2_3", "timed?pause_s=5"
RELAYED = {"quiet_share": 0.0, "earliest_attack_s": 1}
NOISY = {"report": "safety", "correction_noise_mps2": 0.8}
CASES = {
    "one attack, paper": ("paper", {"tau_s": 0.1, "duration_s": 60.0}, ONE, "informed"),
    "two attacks, paper": ("paper", {"tau_s": 0.5, "desired_gap_m": 4.0, "duration_s": 130.0}, TWO, "informed"),
    "own detection": ("easy", {"duration_s": 60.0}, THREE, "local"),
    "noise": ("easy", {**NOISY, "duration_s": 60.0}, THREE, "informed"),
    "relayed, with jams": ("learning", {**RELAYED, "duration_s": 60.0}, "timed?pause_s=20&jam=2", "warned"),
    "platoons drawn": ("easy", {"num_platoons": (4, 8), "duration_s": 60.0}, "random", "local"),
    "the end at a collision": ("easy", {"on_collision": "end", "duration_s": 60.0, "tau_s": 0.5}, THREE, "informed"),
}
K_P, K_D, HEADWAY_S = 1.0, 5.0, 1.5


def both(case: str, spoilt: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a match and the loop end with; gains are spoilt by up to this factor, differently for each episode."""
    preset, overrides, attacker, form = CASES[case]
    config, seeds = DISBANDING.config(preset, overrides), [3, 4, 5]
    generator = np.random.default_rng(0)
    gains = shipped_gains(form)[0] * generator.uniform(1 - spoilt, 1 + spoilt, (len(seeds), *SHAPE))
    thresholds = shipped_gains(form)[1] * generator.uniform(0.5, 1.5, len(seeds))
    policy = StringController(
        DISBANDING.game(config, 1).spec("defender"), form=form, gains=gains, detection_mps=thresholds
    )
    if spoilt == 0:
        policy = StringController(DISBANDING.game(config, 1).spec("defender"), form=form)
    looped = replace(DISBANDING, game=lambda config, num_envs: StringLoop(config, num_envs, policy))
    match = play_episodes(DISBANDING, config, {"attacker": attacker, "defender": policy}, seeds)
    return match, play_episodes(looped, config, {"attacker": attacker}, seeds)


# Rows of gains belong to places in a batch, which shrinks in a match where episodes end early: `Members` sees to that.
PLAYED = [(case, spoilt) for case in CASES for spoilt in (0.0, 0.5) if not (spoilt and "the end" in case)]


@pytest.mark.parametrize(("case", "spoilt"), PLAYED)
def test_the_loop_is_the_match(case: str, spoilt: float) -> None:
    match, loop = both(case, spoilt)
    assert match.keys() == loop.keys()
    for name, values in match.items():
        np.testing.assert_allclose(loop[name], values, rtol=0, atol=1e-12, err_msg=name)


def test_the_cases_hold_collisions_and_safe_episodes() -> None:
    collided = [both("own detection", spoilt)[0]["collided_intact"] for spoilt in (0.0, 0.5)]
    assert np.any(np.concatenate(collided) > 0)
    assert np.any(np.concatenate(collided) == 0)


@pytest.mark.parametrize(
    ("num_vehicles", "tau_s", "gain"),
    [(2, 0.1, 1.0), (3, 0.1, 1.0), (5, 0.1, 1.08), (8, 0.1, 1.42), (10, 0.1, 1.69), (15, 0.1, 2.44), (10, 0.5, 1.82)],
)
def test_peak_gain_of_the_specification(num_vehicles: int, tau_s: float, gain: float) -> None:
    assert peak_gain(num_vehicles, tau_s).gain == pytest.approx(gain, abs=0.005)


def test_the_paper_s_platoon_amplifies_periods_of_forty_seconds() -> None:
    peak = peak_gain(10, 0.1)
    assert peak.frequency_rad_s == pytest.approx(0.150, abs=0.0005)
    assert peak.period_s == pytest.approx(42.0, abs=0.5)


@pytest.mark.parametrize(("num_vehicles", "tau_s"), [(2, 0.5), (4, 0.3), (10, 0.1), (10, 0.5)])
def test_platoons_alone_are_stable_and_follow_slow_changes(num_vehicles: int, tau_s: float) -> None:
    a, _ = platoon_matrices(num_vehicles, tau_s)
    assert np.linalg.eigvals(a).real.max() < 0.0
    assert rear_to_rear_gain(num_vehicles, tau_s, np.array([1e-4]))[0] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("num_vehicles", "tau_s", "frequency"), [(10, 0.1, 0.15), (10, 0.5, 0.4), (5, 0.1, 0.235), (2, 0.5, 3.0)]
)
def test_gain_equals_that_of_a_simulated_platoon(num_vehicles: int, tau_s: float, frequency: float) -> None:
    """The laws vehicle by vehicle in the time domain, with no matrix of the analysis."""
    simulated = simulated_gain(num_vehicles, tau_s, frequency)
    assert simulated == pytest.approx(rear_to_rear_gain(num_vehicles, tau_s, np.array([frequency]))[0], rel=2e-3)


def simulated_gain(num_vehicles: int, tau_s: float, frequency: float) -> float:
    """Amplitude of the last vehicle's speed, over the last three periods, when the speed ahead is a unit sine."""

    def rate(time_s: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        x, v, a = state.reshape(3, num_vehicles)
        gap = np.append(-np.cos(frequency * time_s) / frequency, x[:-1]) - x
        closing = np.append(np.sin(frequency * time_s), v[:-1]) - v
        u = K_P * gap + K_D * closing  # (2.2), and the part ahead of (2.3)
        u[0] -= K_P * HEADWAY_S * v[0]  # (2.4)
        u[1:-1] -= K_P * gap[2:] + K_D * closing[2:]
        return np.concatenate([v, a, (u - a) / tau_s])

    period = 2.0 * np.pi / frequency
    end = max(40.0 * period, 600.0)
    times = np.linspace(end - 3.0 * period, end, 3 * 200, endpoint=False)
    rest = np.zeros(3 * num_vehicles)
    solution = solve_ivp(rate, (0.0, end), rest, "LSODA", times, rtol=1e-7, atol=1e-9)
    speed = solution.y[2 * num_vehicles - 1]
    return float(2.0 * abs(np.mean(speed * np.exp(-1j * frequency * times))))


@pytest.fixture(scope="module")
def stability() -> Stability:
    return analyse()


def test_only_short_platoons_with_a_short_lag_are_string_stable(stability: Stability) -> None:
    assert stability.stable_sizes == {0.1: [2, 3, 4], 0.2: [3, 4], 0.3: [], 0.4: [], 0.5: []}


def test_gain_grows_with_the_platoon_from_five_vehicles_on(stability: Stability) -> None:
    for tau_s in (0.1, 0.5):
        gains = [stability.peaks[size, tau_s].gain for size in range(5, 16)]
        assert gains == sorted(gains)


def test_verdict_contradicts_the_text(stability: Stability) -> None:
    verdict = stability.verdict()
    assert "contradicts section 2.2.1" in verdict
    assert "1.69 times" in verdict
    assert "1.82 times" in verdict
