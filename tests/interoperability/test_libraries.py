"""PettingZoo and TorchRL on the registered environments, by utilities that tests/test_conformance.py does not call."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
import pytest
from pettingzoo.test import max_cycles_test
from pettingzoo.utils import random_demo

from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from tests.settings import tests_of as settings_of

IDS = sorted(env_id for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
# TorchRL reads a MultiDiscrete of one entry as a number, which NumPy 2.4 refuses to convert: two attacked sensors.
OPTIONS = {"cps_envs/FdiAttack-v0": {"attacked": "xv4"}}
EACH = pytest.mark.parametrize("name", PROBLEMS)


def module_of(name: str) -> Any:
    return import_module(f"cps_envs.{name}_v0")


@EACH
def test_episodes_are_cut_after_max_cycles(name: str) -> None:
    module = module_of(name)

    class Learning:  # in preset `paper` the random moves of a test end an FDI episode at once
        parallel_env = staticmethod(partial(module.parallel_env, preset="learning"))
        env = staticmethod(partial(module.env, preset="learning"))

    max_cycles_test(Learning)
    with pytest.raises(ConfigurationError, match="max_cycles = 0 must be a whole number, at least 1"):
        module.parallel_env(max_cycles=0)


@EACH
def test_pettingzoo_s_random_demonstration_plays_the_turn_based_form(name: str) -> None:
    random_demo(module_of(name).env(**settings_of(name).short), render=False, episodes=1)


@pytest.mark.parametrize("env_id", IDS)
def test_torchrl_plays_single_environments(env_id: str) -> None:
    pytest.importorskip("torchrl")
    from torchrl.envs import GymEnv
    from torchrl.envs.utils import check_env_specs

    env = GymEnv(env_id, **OPTIONS.get(env_id, {}))
    check_env_specs(env)
    reward = env.rollout(5)["next", "reward"]
    assert np.isfinite(reward.numpy()).all()


@EACH
def test_torchrl_plays_duels(name: str) -> None:
    pytest.importorskip("torchrl")
    from torchrl.envs import PettingZooWrapper
    from torchrl.envs.utils import check_env_specs

    check_env_specs(PettingZooWrapper(module_of(name).parallel_env(), use_mask=True))
