"""The compiled clocks against what NumPy says."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.compute.clock import count_late, mark_due, mark_ends, restart, tick


@pytest.mark.parametrize("interval", [1, 3])
def test_decisions_are_due_in_marked_environments_at_multiples_of_the_interval(interval: int) -> None:
    elapsed, envs = np.arange(12), np.arange(12) % 5 != 0
    due = np.ones(12, np.bool_)
    assert mark_due(elapsed, envs, interval, due) == due.sum() > 0
    assert (due == (envs & (elapsed % interval == 0))).all()
    assert mark_due(elapsed, np.zeros(12, np.bool_), interval, due) == 0
    assert not due.any()


def test_time_passes_in_marked_environments_only() -> None:
    elapsed, envs = np.array([4, 5, 6]), np.array([True, False, True])
    assert tick(elapsed, envs, 10) == 16
    assert elapsed.tolist() == [14, 5, 16]
    assert tick(np.zeros(3, np.int64), np.zeros(3, np.bool_), 10) == 0


def test_an_environment_ends_by_physics_or_by_the_clock_or_is_cut_off() -> None:
    ended, elapsed = np.array([True, True, False, False, True]), np.array([3, 12, 12, 3, 3])
    envs = np.array([True, True, True, True, False])
    terminated, truncated = np.ones((2, 5), np.bool_)
    assert mark_ends(ended, elapsed, (12, 12), envs, terminated, truncated) == 3
    assert terminated.tolist() == [True, True, True, False, False]
    assert not truncated.any()
    assert mark_ends(ended, elapsed, (15, 12), envs, terminated, truncated) == 3
    assert terminated.tolist() == [True, True, False, False, False]
    assert truncated.tolist() == [False, False, True, False, False]


def test_restarted_clocks_are_at_zero_and_late_ones_are_counted() -> None:
    elapsed, terminated = np.array([3, 4, 5, 6, 7]), np.array([False, False, True, False, False])
    assert count_late(elapsed, terminated, np.array([True, True, True, False, True]), 3) == 2
    restart(elapsed, terminated, np.array([False, True, True, False, True]))
    assert elapsed.tolist() == [3, 0, 0, 6, 0]
    assert not terminated.any()
