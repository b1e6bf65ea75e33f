"""Recipes: where they are found, what they refuse, and how the command line changes them."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import SHARED, Recipe, changed
from cps_agents.recipes.finding import RECIPES, find_recipe
from cps_envs.core.declare.seeds import EVALUATION, TRAINING_START, VALIDATION, training_seed
from cps_envs.core.errors import UntrustedCodeError
from cps_envs.core.types import ROLES
from cps_envs.registration import PROBLEMS

MINE = Recipe(name="mine", problem="rogue", overrides={"duration_s": 3.0})
HERE = "tests.agents.test_recipes"


@dataclass(frozen=True)
class Own(Recipe):
    """A recipe of one's own, as a file beside the package has it."""

    name: str = "own"


def test_recipes_are_found_by_name_and_by_environment() -> None:
    for problem in PROBLEMS.values():
        for role in ROLES:
            env_id = problem.env_id(role)
            found = find_recipe(env_id)
            assert (found.problem, found.role, found.algorithm) == (problem.name, role, SHARED)
            assert find_recipe(env_id.removeprefix("cps_envs/")) == find_recipe(found.name) == found
    assert len(RECIPES) == 2 * len(PROBLEMS)
    with pytest.raises(CommandError, match=r"no recipe and no environment 'rogue-atack'. Did you mean 'rogue-attack'"):
        find_recipe("rogue-atack")


def test_a_recipe_of_ones_own_is_named_by_its_class(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CPS_ENVS_TRUST", raising=False)
    with pytest.raises(UntrustedCodeError):
        find_recipe(f"{HERE}:Own")
    monkeypatch.setenv("CPS_ENVS_TRUST", "1")
    assert find_recipe(f"{HERE}:Own") == Own()
    for name in (f"{HERE}:Owns", f"{HERE}:MINE"):
        with pytest.raises(CommandError, match="MODULE:CLASS"):
            find_recipe(name)
    with pytest.raises(CommandError, match="nothing can be imported"):
        find_recipe("tests.nobody:Own")


def test_recipes_refuse_nonsense() -> None:
    with pytest.raises(CommandError, match="Did you mean 'cma-es'"):
        Recipe(algorithm="cma-e")
    with pytest.raises(CommandError, match="frame_skip = 0"):
        changed(MINE, {"frame_skip": 0})
    with pytest.raises(CommandError, match="two hidden layers of one size"):
        changed(MINE, {"hidden": (64, 32)})
    with pytest.raises(CommandError, match=r"no knob 'learning_rat'.*learning_rate"):
        changed(MINE, {"learning_rat": 1})
    with pytest.raises(CommandError, match="should be like"):
        changed(MINE, {"total_timesteps": "many"})


def test_recipes_change_by_values_of_the_command_line() -> None:
    recipe = changed(MINE, {"hidden": [32, 32], "gamma": 1, "overrides": {"dt_s": 0.001}})
    assert recipe.ppo.hidden == (32, 32)
    assert isinstance(recipe.ppo.gamma, float)
    assert recipe.overrides == {"duration_s": 3.0, "dt_s": 0.001}


def test_seeds_do_not_overlap() -> None:
    assert EVALUATION.stop <= VALIDATION.start
    assert VALIDATION.stop <= TRAINING_START <= training_seed(0)
    assert training_seed(1) - training_seed(0) > 19 * 1024
