"""Blocks of environments in threads: each is called once, errors arrive, and copies have threads of their own."""

from __future__ import annotations

import copy
import pickle
import threading
import time
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.compute.threads import UNTIMED, Threads
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.game import Game
from cps_envs.core.types import BoolArray
from tests.core.toy import ToyConfig, ToyGame


def split(num_threads: int, num_envs: int) -> Threads:
    """Threads that are used whatever there is to do."""
    threads = Threads(num_threads, num_envs)
    threads.worth_s = 0.0
    return threads


@pytest.mark.parametrize(("num_threads", "num_envs"), [(1, 5), (2, 5), (3, 5), (8, 5), (4, 1)])
def test_every_marked_environment_is_in_exactly_one_call(num_threads: int, num_envs: int) -> None:
    threads, envs = split(num_threads, num_envs), np.arange(num_envs) != 1
    calls: list[BoolArray] = []
    threads.run(calls.append, envs)
    assert len(calls) == min(num_threads, num_envs)
    assert (np.sum(calls, axis=0) == envs).all()


def test_the_calls_run_side_by_side() -> None:
    together = threading.Barrier(3, timeout=20)
    split(3, 3).run(lambda envs: together.wait(), np.ones(3, np.bool_))


def test_only_work_that_is_worth_it_is_split() -> None:
    threads, everyone = Threads(2, 4), np.ones(4, np.bool_)
    threads.worth_s = 0.02
    blocks: list[int] = []

    def take(pause_s: float) -> int:
        """How many blocks the next call is split into, which then takes so long for each game step and environment."""
        blocks.clear()
        threads.run(lambda envs: blocks.append(1) or time.sleep(pause_s * envs.sum()), everyone)
        return len(blocks)

    assert [take(0.01), take(0.0), take(0.0)] == [1, 1, 1]  # one slow call says nothing: it may have compiled
    assert {take(0.01) for _ in range(UNTIMED - 1)} == {1}  # after a short one the clock rests
    assert [take(0.01), take(0.01), take(0.01)] == [1, 1, 2]
    threads.run(lambda envs: blocks.append(1) or time.sleep(0.01), everyone & [True, False, False, False])
    assert len(blocks) == 3  # two, and then one environment alone
    assert [take(0.0), take(0.0)] == [2, 1]


def test_an_error_in_a_thread_arrives() -> None:
    def fail(envs: BoolArray) -> None:
        if envs[-1]:
            raise ArithmeticError("in the last block")

    with pytest.raises(ArithmeticError, match="in the last block"):
        split(2, 4).run(fail, np.ones(4, np.bool_))


def test_threads_are_pickled_and_copied_without_their_pool() -> None:
    threads = split(2, 4)
    threads.run(lambda envs: None, np.ones(4, np.bool_))
    for other in (pickle.loads(pickle.dumps(threads)), copy.deepcopy(threads)):
        calls: list[BoolArray] = []
        other.run(calls.append, np.ones(4, np.bool_))
        assert len(calls) == 2


def test_num_threads_is_an_argument_of_the_vector_form() -> None:
    runs = []
    for num_threads in (1, 3):
        env: Any = gymnasium.make_vec("toys/ToyDefense-v0", 7, "vector_entry_point", num_threads=num_threads)
        env.reset(seed=3)
        runs.append([env.step(np.full((7, 2), 0.1, np.float32))[0] for _ in range(20)])
    np.testing.assert_array_equal(*runs)


def test_nonsense_and_games_of_one_thread_are_refused() -> None:
    class Single(ToyGame):
        threaded = False

    with pytest.raises(ConfigurationError, match="num_threads = 0 must be at least 1"):
        ToyGame(ToyConfig(), 3).use_threads(0)
    game: Game = Single(ToyConfig(), 3)
    game.use_threads(1)
    with pytest.raises(ConfigurationError, match="'toy' runs in one thread"):
        game.use_threads(2)
