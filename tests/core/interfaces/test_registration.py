"""The classes and functions that show a declared problem, as a package of one's own would make them."""

from __future__ import annotations

import inspect
import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pettingzoo
import pytest
from pettingzoo import ParallelEnv

from cps_envs.core.conformance import find_subject
from cps_envs.core.interfaces.forms import declare
from cps_envs.core.interfaces.registration import class_name, register
from tests.core.toy import TOY

TWIN = replace(TOY, name="twin")
PAGE = """Reach the beacon.

## Observation Space
{observation_table}

## Arguments
{parameter_table}
"""

forms = declare(TWIN, __name__, attack=PAGE, defense="Catch the intruder.", rhythm="every second", swarm="Two axes.")
TwinAttackEnv, TwinAttackVectorEnv = forms.attack
TwinDefenseEnv, TwinDefenseVectorEnv = forms.defense
parallel_env, env, swarm_env = forms.parallel_env, forms.env, forms.swarm_env


@pytest.fixture
def _registered() -> None:
    register(TWIN, __name__)


def test_names_and_pages() -> None:
    assert [class_name(TWIN, role) for role in ("attacker", "defender")] == ["TwinAttack", "TwinDefense"]
    assert (TwinAttackEnv.__name__, TwinAttackEnv.__module__) == ("TwinAttackEnv", __name__)
    page = inspect.getdoc(TwinAttackEnv) or ""
    assert page.startswith("Reach the beacon.")
    assert "| 0-1 | `own` |" in page
    assert "| `duration_s` | 12.0 | s |" in page
    assert inspect.getdoc(TwinDefenseVectorEnv) == "`TwinDefenseEnv` for a whole batch."
    assert "`pettingzoo.ParallelEnv`. They act every second." in (inspect.getdoc(parallel_env) or "")
    assert "any field of `ToyConfig`" in (inspect.getdoc(swarm_env) or "")


@pytest.mark.parametrize("made", [*forms.attack, *forms.defense, parallel_env, env, swarm_env])
def test_classes_and_functions_are_pickled_by_name(made: object) -> None:
    assert pickle.loads(pickle.dumps(made)) is made


def test_environments_are_pickled() -> None:
    environment = TwinAttackEnv(opponent="none")
    environment.reset(seed=1)
    clone = pickle.loads(pickle.dumps(environment))
    np.testing.assert_array_equal(environment.step(1)[0], clone.step(1)[0])


@pytest.mark.usefixtures("_registered")
def test_ids_are_registered_once() -> None:
    register(TWIN, __name__)
    single = gymnasium.make("toys/TwinDefense-v0", opponent="none")
    assert type(single.unwrapped) is TwinDefenseEnv
    assert gymnasium.make_vec("toys/TwinDefense-v0", 2, "vector_entry_point").num_envs == 2
    assert isinstance(pettingzoo.make("parallel", "toys/twin-v0"), ParallelEnv)
    assert find_subject(f"{__name__}:toys/TwinAttack-v0", {}).vector_class is TwinAttackVectorEnv


def test_the_forms_of_pettingzoo() -> None:
    assert parallel_env().possible_agents == ["attacker_0", "defender_0"]
    assert env().possible_agents == ["attacker_0", "defender_0"]
    assert swarm_env(opponent="none").possible_agents == ["axis_0", "axis_1"]
