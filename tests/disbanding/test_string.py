"""The stability of strings with the published gains."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.disbanding.string_stability import (
    Stability,
    analyse,
    peak_gain,
    platoon_matrices,
    rear_to_rear_gain,
    stability_data,
    stability_tables,
)

K_P, K_D, HEADWAY_S = 1.0, 5.0, 1.5


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
    end = max(15.0 * period, 200.0)
    times = np.linspace(end - 3.0 * period, end, 3 * 200, endpoint=False)
    rest = np.zeros(3 * num_vehicles)
    solution = solve_ivp(rate, (0.0, end), rest, "LSODA", times, rtol=1e-6, atol=1e-8)
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


def test_the_exhibit_has_every_length_and_lag_and_the_verdict() -> None:
    (table,) = stability_tables(DisbandingEvidence())
    assert len(table.rows) == 14
    assert table.rows[8][:2] == ("10", "1.688  0.150    42 s")
    document = stability_data(DisbandingEvidence())
    assert len(document["peaks"]) == 14 * 5
    (peak,) = (row for row in document["peaks"] if (row["vehicles_per_platoon"], row["tau_s"]) == (10, 0.1))
    assert peak["gain"] == pytest.approx(1.69, abs=0.005)
    assert document["stable_sizes"]["0.5"] == []
    assert document["verdict"] == table.notes[0]
