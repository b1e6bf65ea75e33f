from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.disbanding.config import INTERPRETATIONS
from cps_envs.disbanding.state import State
from tests.disbanding.table_2_1 import metrics, run, start, table_2_1

WIDTH, PLATOONS = 20, 4
GROWING = ("step", "speed_error", "intact_error", "rear_collided", "collided", "collided_intact", "stops")


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def rows(low: float, high: float) -> st.SearchStrategy[np.ndarray]:
    seeds = st.integers(0, 2**32 - 1)
    return seeds.map(lambda seed: np.random.default_rng(seed).uniform(low, high, (1, WIDTH)))


situations = st.fixed_dictionaries(
    {
        "interpretation": st.sampled_from(list(INTERPRETATIONS)),
        "num_vehicles": st.sampled_from([10, 15, 20]),
        "tau_s": numbers(0.05, 0.6),
        "desired_gap_m": numbers(1.5, 8.0),
        "attack": st.dictionaries(st.integers(1, PLATOONS), numbers(0.0, 8.0), max_size=3),
        "gap_factor": rows(0.5, 1.5),
        "speed_offset_mps": rows(-10.0, 5.0),
        "takeover_delay_s": rows(0.0, 2.0),
        "driver_headway_s": rows(0.5, 2.5),
    }
)


@settings(max_examples=60, deadline=None)
@given(situation=situations, corrections=st.lists(rows(-6.0, 6.0), min_size=4, max_size=4))
def test_whatever_happens_the_state_stays_physical(situation: dict[str, Any], corrections: list[np.ndarray]) -> None:
    names = ("interpretation", "num_vehicles", "tau_s", "desired_gap_m")
    parameters = table_2_1(1, vehicles_per_platoon=5, **{name: situation.pop(name) for name in names})
    attack = situation.pop("attack").items()
    state = start(parameters, attack, PLATOONS, **situation)
    present = int(parameters["num_vehicles"][0])
    for correction in corrections:
        before = State(*(array.copy() for array in state))
        run(state, parameters, 4.0, correction)
        for name in ("position", "speed", "acceleration", "command", "speed_error", "intact_error"):
            assert np.isfinite(getattr(state, name)).all(), name
        assert (state.speed >= 0.0).all()
        assert (state.speed <= 36.0).all()
        assert (np.abs(state.acceleration[0, :present] + 2.0) <= 3.0 + 1e-9).all()
        for name in GROWING:
            assert (getattr(state, name) >= getattr(before, name)).all(), name
        if not parameters["inelastic_contact"][0]:
            assert (state.position[0, :present] >= before.position[0, :present]).all()
        assert_consistent(state, before, metrics(state, parameters))


def assert_consistent(state: State, before: State, ours: dict[str, float]) -> None:
    """What the accumulators must say about one another."""
    involved = state.rear_collided.copy()
    involved[:, :-1] |= state.rear_collided[:, 1:]
    np.testing.assert_array_equal(state.collided, involved)
    assert (state.collided | ~state.collided_intact).all()
    assert (state.first_collision_s[0] >= 0.0) == state.collided.any()
    if before.first_collision_s[0] >= 0.0:
        assert state.first_collision_s[0] == before.first_collision_s[0]
    assert ours["collided"] == state.collided.sum()
    assert 0.0 <= ours["stopped_share"] <= 100.0
    assert 0.0 <= ours["velocity_error_intact"] <= 100.0
