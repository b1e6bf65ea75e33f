"""What every adapter of every problem promises to a learner."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance.actors import allows
from cps_envs.core.policies.adapter import Adapter, adapter_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.state import take
from cps_envs.core.types import ROLES, Array, Role, State
from tests.episodes import OnAct, Through, play, spec_of
from tests.settings import tests_of as settings_of
from tests.turns import slow

ADAPTERS = [
    (problem, role, name)
    for problem in PROBLEMS
    for role in ROLES
    for name in spec_of(PROBLEMS[problem], role, "learning").adapters
]
SHOWN = {  # adapters whose columns are made to vary: the episodes that it takes, and columns that wait for an action
    ("disbanding", "defender", "follow"): (12, 0),
    ("disbanding", "defender", "follow_road"): (12, 0),
    ("fdi", "attacker", "motion"): (64, 2),
    ("fdi", "defender", "sensor"): (200, 2),
    ("hvac", "attacker", "expected"): (60, 1),
    ("hvac", "defender", "sensor"): (60, 0),
    ("rogue", "defender", "vehicle"): (32, 0),
}


def playing(problem: str, adapter: Adapter, action: Any, on_act: OnAct, episodes: int, **overrides: Any) -> None:
    """Episodes of preset `learning` through an adapter against whom it usually meets."""
    players = {**PROBLEMS[problem].opponents["learning"], adapter.spec.role: Through(adapter, action, on_act)}
    play(PROBLEMS[problem], **players, seeds=range(episodes), preset="learning", **overrides)


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
@pytest.mark.parametrize(("problem", "role", "name"), ADAPTERS)
def test_rows_and_actions_are_legal_and_environments_know_nothing_of_one_another(
    problem: str, role: Role, name: str
) -> None:
    short = settings_of(problem).short
    adapter = adapter_of(spec_of(PROBLEMS[problem], role, "learning", **short), name)

    def look(seen: Seen, state: State, chosen: Array, action: Array, after: State) -> None:
        rows, active = adapter.observe(seen, state), adapter.active(seen, state)
        assert rows.shape == (len(seen), len(adapter.agents), adapter.fields.size)
        assert rows.dtype == np.float32
        assert np.abs(rows).max() <= 1
        assert rows.flags.writeable
        assert not np.shares_memory(rows, seen.observation)
        assert (active.shape, active.dtype) == (rows.shape[:2], np.bool_)
        for b, taken in enumerate(action):
            assert adapter.spec.action_space.contains(taken.astype(adapter.spec.action_space.dtype))
            assert allows(adapter.spec.action_space, None if seen.masks is None else seen.masks[b], taken)
        last = np.array([len(seen) - 1])
        alone, own = seen.part(last), take(state, last) or ()
        np.testing.assert_allclose(adapter.observe(alone, own), rows[last], atol=1e-6)
        np.testing.assert_array_equal(adapter.active(alone, own), active[last])
        taken, next_own = adapter.act(alone, own, chosen[last])
        for found, wanted in zip((taken, *next_own), (action, *after), strict=True):
            np.testing.assert_allclose(found, wanted[last], atol=1e-6)

    playing(problem, adapter, None, look, 3, **short)


@pytest.mark.parametrize(
    ("problem", "role", "name"), [slow(case) if case[0] == "disbanding" else case for case in SHOWN]
)
def test_nine_of_ten_columns_vary_under_the_neutral_action(problem: str, role: Role, name: str) -> None:
    adapter, rows = adapter_of(spec_of(PROBLEMS[problem], role, "learning"), name), []
    episodes, waiting = SHOWN[problem, role, name]

    def look(seen: Seen, state: State, chosen: Array, action: Array, after: State) -> None:
        there = adapter.active(seen, state) | (name == "motion")  # which waits for its onset
        rows.append(adapter.observe(seen, state)[there])

    playing(problem, adapter, adapter.neutral_action, look, episodes)
    spread = np.concatenate(rows).std(axis=0)
    assert np.mean(spread >= 0.2) >= 0.9, spread.round(2)
    assert np.sum(spread < 0.05) == waiting, spread.round(2)
