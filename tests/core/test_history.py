from __future__ import annotations

import numpy as np

from cps_envs.core.picture.history import History


def add(history: History, time_s: float, value: float = 0.0, *, episode: int = 0) -> bool:
    return history.add(episode, (time_s,), np.array([time_s, value]))


def test_moments_follow_each_other_and_the_last_can_be_told_again() -> None:
    history = History(100)
    assert history.rows().shape[0] == 0
    assert add(history, 0.0)
    assert not add(history, 1.0, 5.0)
    assert not add(history, 1.0, 6.0)
    assert history.rows().tolist() == [[0.0, 0.0], [1.0, 6.0]]


def test_what_tells_two_moments_of_a_time_apart_keeps_both() -> None:
    history = History(100)
    for sensed in (0.0, 1.0, 1.0):
        history.add(0, (1.0, sensed), np.array([1.0, sensed]))
    assert history.rows().tolist() == [[1.0, 0.0], [1.0, 1.0]]


def test_another_episode_time_that_goes_back_and_other_rows_begin_anew() -> None:
    history = History(100)
    for episode, time_s in ((0, 0.0), (0, 2.0), (1, 3.0), (1, 1.0)):
        begins = add(history, time_s, episode=episode)
        assert begins == (time_s != 2.0)
    assert history.rows().tolist() == [[1.0, 0.0]]
    assert history.add(1, (4.0,), np.zeros(3))
    assert history.rows().shape == (1, 3)


def test_long_episodes_are_thinned_between_the_first_and_the_last_moment() -> None:
    history = History(50)
    for k in range(1000):
        add(history, float(k))
        rows = history.rows()
        assert (rows[0, 0], rows[-1, 0]) == (0.0, k)
        assert len(rows) <= 52
    assert history.every()[:, 0].tolist() == list(range(1000))
