from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_baselines.disbanding.heuristic_policy import (
    FORESIGHT,
    Foresight,
    next_below,
    overlaps,
    travelled_distance,
    travelled_distance_command,
)
from cps_envs.core.compute.kernels import unpack
from cps_envs.disbanding.state import Constants
from tests.disbanding.table_2_1 import run, run_heuristic, start, table_2_1

CONSTANTS = unpack(Constants, table_2_1(), 0)
speeds = st.floats(0.0, 36.0)
commands = st.floats(-5.0, 1.0)


FINE = Foresight(num_samples=20, sample_s=0.05, decrement_mps2=0.2, clearance_m=1.0)


def samples(speed: float, command: float, count: int = 5, sample_s: float = 0.1) -> np.ndarray:
    """Distances (m) at the samples of the horizon, (2.13)."""
    distances, distance = [], 0.0
    for _ in range(count):
        distance, speed = distance + sample_s * speed, min(max(speed + sample_s * command, 0.0), 36.0)
        distances.append(distance)
    return np.array(distances)


@given(speed=speeds, command=commands)
def test_travelled_distance(speed: float, command: float) -> None:
    assert travelled_distance(speed, command, 0.0, 36.0, FORESIGHT) == pytest.approx(samples(speed, command)[-1])


@given(gap=st.floats(-5.0, 20.0), speed=speeds, command=commands, ahead=speeds, ahead_command=commands)
def test_overlap(gap: float, speed: float, command: float, ahead: float, ahead_command: float) -> None:
    predicted = gap + samples(ahead, ahead_command) - samples(speed, command)
    if np.abs(predicted).min() > 1e-9:
        assert overlaps(gap, speed, command, ahead, ahead_command, 0.0, 36.0, FORESIGHT) == bool(
            (predicted <= 0.0).any()
        )


@given(command=st.floats(-4.99, 1.0))
def test_next_below_goes_down_on_the_grid(command: float) -> None:
    lower = next_below(command, -5.0, 0.1)
    grid = (lower + 5.0) / 0.1
    assert grid == pytest.approx(round(grid))
    assert command - 0.1 - 1e-8 <= lower < command


def test_next_below_leaves_a_value_of_the_grid() -> None:
    value, visited = 1.0, []
    while value > -5.0:
        value = next_below(value, -5.0, 0.1)
        visited.append(value)
    np.testing.assert_allclose(visited, np.linspace(0.9, -5.0, 60), atol=1e-12)


@given(
    law=st.floats(-200.0, 200.0),
    command_ahead=st.floats(-20.0, 7.0),
    gap=st.floats(-2.0, 60.0),
    speed=speeds,
    speed_ahead=speeds,
)
def test_command(law: float, command_ahead: float, gap: float, speed: float, speed_ahead: float) -> None:
    """It keeps the raw law where the law covers no more distance, and else is the largest command of its choice."""
    ours = travelled_distance_command(law, command_ahead, gap, speed, speed_ahead, CONSTANTS, FORESIGHT)
    ahead = samples(speed_ahead, min(max(command_ahead, -5.0), 1.0))
    if ahead[-1] >= samples(speed, min(max(law, -5.0), 1.0))[-1] + 1e-9:
        assert ours == law
    elif ahead[-1] < samples(speed, min(max(law, -5.0), 1.0))[-1] - 1e-9:
        matching = min(max((ahead[-1] - 0.5 * speed) / 0.125, -5.0), 1.0)
        assert -5.0 <= ours <= matching + 1e-9
        assert ours == pytest.approx(-5.0) or (gap + ahead - samples(speed, ours)).min() > -1e-9
        if ours < matching - 1e-9:
            above = min(ours + 0.1, matching)
            assert (gap + ahead - samples(speed, above)).min() <= 1e-6


@given(law=commands, command_ahead=commands, gap=st.floats(0.5, 30.0), speed=speeds, speed_ahead=speeds)
def test_command_of_another_foresight(
    law: float, command_ahead: float, gap: float, speed: float, speed_ahead: float
) -> None:
    """A horizon of 1 s in samples of 0.05 s, decrements of 0.2 m/s2, and 1 m of clearance."""
    ours = travelled_distance_command(law, command_ahead, gap, speed, speed_ahead, CONSTANTS, FINE)
    ahead = samples(speed_ahead, command_ahead, 20, 0.05)
    excess = samples(speed, law, 20, 0.05)[-1] - ahead[-1]
    if excess < -1e-9:
        assert ours == law
    elif excess > 1e-9:
        matching = min(max((ahead[-1] - speed) / 0.5, -5.0), 1.0)
        assert ours <= matching + 1e-9
        assert ours == pytest.approx(-5.0) or (gap + ahead - samples(speed, ours, 20, 0.05)).min() > 1.0 - 1e-9
        if ours < matching - 1e-9:
            above = min(ours + 0.2, matching)
            assert (gap + ahead - samples(speed, above, 20, 0.05)).min() <= 1.0 + 1e-6


def test_without_an_attack_nothing_changes() -> None:
    parameters = table_2_1()
    plain, mitigated = start(parameters), start(parameters)
    run(plain, parameters, 20.0)
    run_heuristic(mitigated, parameters, 20.0)
    for ours, theirs in zip(mitigated, plain, strict=True):
        np.testing.assert_array_equal(ours, theirs)
