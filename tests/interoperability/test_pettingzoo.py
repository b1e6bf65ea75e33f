"""PettingZoo's own utilities: its API tests and its random demonstration."""

from __future__ import annotations

from functools import partial
from importlib import import_module

import pytest
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test
from pettingzoo.utils import random_demo

from cps_envs.core.errors import ConfigurationError

SHORT = {
    "disbanding": {"duration_s": 5.0},
    "fdi": {},
    "hvac": {"num_steps": 130, "window_steps": 100, "onset_step": 90},
    "rogue": {"duration_s": 2.0},
}


@pytest.mark.parametrize("name", SHORT)
def test_apis(name: str) -> None:
    module = import_module(f"cps_envs.{name}_v0")
    parallel_api_test(module.parallel_env(**SHORT[name]), num_cycles=50)
    api_test(module.env(**SHORT[name]), num_cycles=50)


@pytest.mark.parametrize("name", SHORT)
def test_episodes_are_cut_after_max_cycles(name: str) -> None:
    module = import_module(f"cps_envs.{name}_v0")

    class Learning:  # in preset `paper` the random moves of a test end an FDI episode at once
        parallel_env = staticmethod(partial(module.parallel_env, preset="learning"))
        env = staticmethod(partial(module.env, preset="learning"))

    max_cycles_test(Learning)
    with pytest.raises(ConfigurationError, match="max_cycles = 0 must be a whole number, at least 1"):
        module.parallel_env(max_cycles=0)


@pytest.mark.parametrize("name", SHORT)
def test_random_demonstration(name: str) -> None:
    random_demo(import_module(f"cps_envs.{name}_v0").env(**SHORT[name]), render=False, episodes=1)
