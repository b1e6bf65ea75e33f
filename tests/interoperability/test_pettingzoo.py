"""PettingZoo's tests of interfaces and its demonstration, and supersuit's wrappers."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import pytest
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test
from pettingzoo.utils import random_demo

from cps_envs.core.errors import ConfigurationError
from cps_envs.registration import PROBLEMS
from tests.settings import tests_of as settings_of

EACH = pytest.mark.parametrize("name", PROBLEMS)
CONFORMANCE = pytest.mark.slow  # tests/test_conformance.py calls it, too


class Duel:
    """A duel's module in preset `learning`: in `paper` the random moves of a test end an FDI episode at once."""

    def __init__(self, name: str) -> None:
        self.module: Any = import_module(f"cps_envs.{name}_v0")
        self.parallel_env = partial(self.module.parallel_env, preset="learning")
        self.env = partial(self.module.env, preset="learning")


@CONFORMANCE
@EACH
def test_turns(name: str) -> None:
    """api_test"""
    api_test(Duel(name).env(), num_cycles=20)


@CONFORMANCE
@EACH
def test_parallel(name: str) -> None:
    """parallel_api_test"""
    parallel_api_test(Duel(name).parallel_env(), 20)


@CONFORMANCE
@EACH
def test_seeds(name: str) -> None:
    """seed_test"""
    seed_test(partial(Duel(name).env, max_cycles=5), 5)


@CONFORMANCE
@EACH
def test_parallel_seeds(name: str) -> None:
    """parallel_seed_test"""
    parallel_seed_test(Duel(name).parallel_env)


@EACH
def test_episodes_are_cut_after_max_cycles(name: str) -> None:
    """max_cycles_test"""
    max_cycles_test(Duel(name))
    with pytest.raises(ConfigurationError, match="max_cycles = 0 must be a whole number, at least 1"):
        Duel(name).module.parallel_env(max_cycles=0)


@EACH
def test_demonstration(name: str) -> None:
    """random_demo of the turn-based form"""
    random_demo(Duel(name).module.env(**settings_of(name).short), render=False, episodes=1)


@EACH
def test_suits(name: str) -> None:
    """supersuit: frame_stack, clip_reward"""
    supersuit = pytest.importorskip("supersuit")
    env = supersuit.clip_reward_v0(supersuit.frame_stack_v1(Duel(name).parallel_env()))
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
