from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from cps_envs.disbanding.state import Constants
from tests.disbanding.reference import Reference
from tests.disbanding.table_2_1 import run, start, steps, table_2_1

SHAPE = {"num_vehicles": 20, "vehicles_per_platoon": 5}
CASES = {
    "no attack, perturbed": {"attack": ()},
    "lead": {"attack": ((4, 1.0),)},
    "middle": {"attack": ((3, 1.0),)},
    "two, slow actuators": {"attack": ((4, 1.0), (2, 12.0)), "tau_s": 0.5, "desired_gap_m": 4.0},
    "rear": {"attack": ((1, 2.5),), "tau_s": 0.3},
}


def every_pair() -> Iterator[object]:
    """Each case under each reading, with corrections every second time: each pair of the three at least once."""
    for place, (case, interpretation) in enumerate(product(CASES, ("S0", "S1", "S2"))):
        kind = "corrected" if place % 2 else "plain"
        yield pytest.param(case, interpretation, bool(place % 2), id=f"{case}-{interpretation}-{kind}")


@pytest.mark.parametrize(("case", "interpretation", "corrections"), list(every_pair()))
def test_kernel_agrees_with_the_plain_loop(case: str, interpretation: str, corrections: bool) -> None:
    rng = np.random.default_rng(7)
    changes = dict(CASES[case])
    attack = changes.pop("attack")
    parameters = table_2_1(1, interpretation, **SHAPE, **changes)
    perturbation = {
        "gap_factor": rng.uniform(0.95, 1.05, (1, 20)),
        "speed_offset_mps": rng.uniform(-0.5, 0.5, (1, 20)),
        "takeover_delay_s": rng.uniform(0.0, 2.0, (1, 20)),
        "driver_headway_s": rng.uniform(1.2, 1.8, (1, 20)),
    }
    state = start(parameters, attack, 4, **perturbation)
    p = SimpleNamespace(**{name: parameters[name][0] for name in Constants._fields})
    rows = (state.position, state.speed, state.disbanding_s, state.takeover_delay_s, state.driver_headway_s)
    reference = Reference(p, *(row[0].copy() for row in rows))
    for _ in range(5):
        correction = rng.uniform(-0.4, 0.2, (1, 20)) if corrections else np.zeros((1, 20))
        run(state, parameters, 4.0, correction)
        reference.advance(steps(parameters, 4.0), correction[0])
    pairs = {
        "position": (state.position, reference.x),
        "speed": (state.speed, reference.v),
        "acceleration": (state.acceleration, reference.a),
        "command": (state.command, reference.u),
        "previous_gap": (state.previous_gap, reference.previous_gap),
        "speed_error": (state.speed_error, reference.error),
        "intact_error": (state.intact_error, reference.intact_error),
    }
    for name, (ours, theirs) in pairs.items():
        np.testing.assert_allclose(np.squeeze(ours), theirs, rtol=1e-7, atol=1e-6, err_msg=name)
    assert set(np.flatnonzero(state.rear_collided[0])) == reference.rear
    assert set(np.flatnonzero(state.collided[0])) == set(reference.involved)
    assert set(np.flatnonzero(state.collided_intact[0])) == {q for q, intact in reference.involved.items() if intact}
    assert state.first_collision_s[0] == pytest.approx(reference.first_collision)
    np.testing.assert_array_equal(state.stops[0], reference.stops)
