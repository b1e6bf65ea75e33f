from __future__ import annotations

import numpy as np
import pytest

from cps_envs.disbanding.interpretation import INTERPRETATIONS
from cps_envs.disbanding.queries import brake_margin, law_command, law_commands, mitigable
from tests.disbanding.table_2_1 import TWO, run, start, table_2_1


@pytest.mark.parametrize("interpretation", INTERPRETATIONS)
def test_questions_agree_with_the_next_step(interpretation: str) -> None:
    """Unless it brakes for (2.6), a vehicle does next what `law_command` says; one vehicle equals all at once."""
    parameters = table_2_1(2, interpretation, tau_s=[0.1, 0.4])
    delays = np.random.default_rng(0).uniform(0.0, 2.0, (2, 100))
    state, law = start(parameters, TWO, takeover_delays_s=delays), np.empty((2, 100))
    step_s = float(parameters["dt_s"][0])
    braked = 0
    for _ in range(24):
        run(state, parameters, 5.0)
        law_commands(state, parameters, law)
        single = [[law_command(state, parameters, b, q) for q in range(100)] for b in range(2)]
        np.testing.assert_array_equal(single, law)
        margins = np.array([[brake_margin(state, parameters, b, q) for q in range(100)] for b in range(2)])
        expected = np.clip(law, -5.0, 1.0) if parameters["saturate_command"][0] else law
        expected = np.where(margins <= 0.0, -5.0, expected)
        braked += int((margins <= 0.0).sum())
        run(state, parameters, step_s)
        np.testing.assert_array_equal(state.command, expected)
    assert braked > 0


def test_mitigable_vehicles_are_intact_and_upstream() -> None:
    parameters = table_2_1(num_vehicles=40)
    state = start(parameters, ((8, 2.0), (10, 3.0)))
    expected = {0.0: [], 1.99: [], 2.0: range(30, 40), 3.0: [*range(10, 20), *range(30, 40)]}
    for seconds, vehicles in expected.items():
        state.step[0] = round(seconds / 0.01)
        assert [q for q in range(40) if mitigable(state, parameters, 0, q)] == list(vehicles)
