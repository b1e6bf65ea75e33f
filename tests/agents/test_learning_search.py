"""The search for plans, the best episodes, their imitation, and the rewards and masks of the recipes that use them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

from cps_agents.errors import CommandError
from cps_agents.learning.best_episodes import BestEpisodes
from cps_agents.learning.demonstrations import Demonstrations
from cps_agents.learning.learner import learn
from cps_agents.learning.model import focus, seen_columns
from cps_agents.learning.plan_search import search_plans
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.training_envs import TrainingEnvs, make_envs
from cps_agents.recipes.fdi import FdiAttack, FdiDefense
from cps_envs.fdi.game import FdiGame

TINY = FdiAttack(
    overrides={
        "attack_action": "share",
        "share_levels": 3,
        "mask": "look_ahead",
        "shield": True,
        "tasks": "x4>4 v1>1",
    },
    num_envs=16,
    total_steps=640,
    batch_size=160,
    hidden=(32,),
    search_steps=24_000,
    teacher_epochs=300,
    evaluations=1,
    evaluation_episodes=8,
)


def episode(start: float, action: int) -> Demonstrations:
    return Demonstrations(np.full((2, 3), start, np.float32), np.full((2, 1), action), None)


def test_the_best_episode_of_each_start_is_kept() -> None:
    best = BestEpisodes()
    assert best.demonstrations() is None
    assert np.isnan(best.mean_return())
    for total, start, action in ((1.0, 0.0, 1), (3.0, 0.0, 2), (2.0, 0.0, 3), (-1.0, 1.0, 4)):
        best.keep(total, episode(start, action))
    shown = best.demonstrations()
    assert shown is not None
    assert shown.actions.ravel().tolist() == [2, 2, 4, 4]
    assert best.mean_return() == 1.0


def played(envs: TrainingEnvs, shown: Demonstrations) -> list[float]:
    """The learned return of each demonstrated episode when its actions are played again from its start."""
    starts = envs.reset()
    first = [
        row for row in range(len(shown.actions)) if any(np.array_equal(shown.observations[row], s) for s in starts)
    ]
    returns = []
    for begin, end in zip(first, [*first[1:], len(shown.actions)], strict=True):
        starts = envs.reset()
        episode = next(i for i, s in enumerate(starts) if np.array_equal(s, shown.observations[begin]))
        total = 0.0
        for row in range(begin, end):
            envs.step_async(np.repeat(shown.actions[row][np.newaxis], envs.num_envs, axis=0))
            _, rewards, _, _ = envs.step_wait()
            total += float(rewards[episode])
        returns.append(total)
    return returns


def test_a_search_finds_good_plans_that_attain_what_it_says() -> None:
    envs = make_envs(TINY, 2_000_000)
    first, best = BestEpisodes(), BestEpisodes()
    search_plans(envs, replace(TINY, search_steps=640), first, 0, lambda steps, mean: None)
    search_plans(envs, TINY, best, 0, lambda steps, mean: None)
    assert best.mean_return() > max(first.mean_return(), 0.8)  # shares of the certified optima
    shown = best.demonstrations()
    assert shown is not None
    assert shown.masks is not None
    assert np.mean(played(envs, shown)) == pytest.approx(best.mean_return(), abs=1e-6)
    ends = np.cumsum(envs.action_space.nvec)  # type: ignore[attr-defined]
    chosen = shown.actions + np.concatenate([[0], ends[:-1]])
    assert np.take_along_axis(shown.masks, chosen, axis=1).all()


def test_a_search_needs_discrete_entries() -> None:
    recipe = Recipe(problem="hvac", num_envs=2, search_steps=10)
    with pytest.raises(CommandError, match="MultiDiscrete"):
        search_plans(make_envs(recipe, 2_000_000), recipe, BestEpisodes(), 0, lambda steps, mean: None)


def test_a_run_imitates_the_plans_of_its_search(tmp_path: Path) -> None:
    found = learn(TrainingJob(TINY, 0, tmp_path / "run", "test"))
    untaught = learn(TrainingJob(replace(TINY, search_steps=0, self_imitation=0), 0, tmp_path / "other", "test"))
    assert found["best_score"] > untaught["best_score"] + 0.5


def test_misses_cost_by_distance_and_hits_pay_in_shares() -> None:
    envs = make_envs(TINY, 2_000_000)
    envs.reset()
    game = envs.env.game
    assert isinstance(game, FdiGame)
    game.state.error[0, 3], game.state.error[0, 0] = -2.0, -2.0  # the target is the lead or the last
    none, ended = np.zeros(16), np.ones(16, np.bool_)
    learned = TINY.learned(game, none, ended)
    assert learned[0] == pytest.approx(-(5 - 2) / 5)
    assert (TINY.learned(game, none, ~ended) == 0).all()
    assert TINY.learned(game, np.full(16, 2.0), ended) == pytest.approx(2 / game.metrics()["oracle_value_mps"])


def test_unattacked_entries_are_fixed() -> None:
    envs = make_envs(TINY, 2_000_000)
    envs.reset()
    masks = envs.action_masks().reshape(16, 8, 4)
    attacked = envs.observe()[:, envs.env.game.fields["attacker"].slices["attacked"]] > 0
    assert (attacked.sum(axis=1) == 1).all()
    assert masks[attacked].tolist() == [[False, True, True, True]] * 16
    assert (masks[~attacked] == [True, False, False, False]).all()


def test_focus_scales_about_zero_by_units() -> None:
    recipe = FdiDefense(num_envs=2, opponent="none")
    envs = make_envs(recipe, 2_000_000)
    columns = seen_columns(envs, recipe)
    ones = np.ones(len(columns))
    mean, deviation = focus(envs, recipe, columns, ones, ones)
    fields = envs.env.game.fields["defender"]
    values = np.zeros((1, fields.size))
    values[0, fields.slices["rate_innovation"]] = 0.125
    part = fields.slices["rate_innovation"]
    assert ((fields.encode(values)[0] - mean) / deviation)[part] == pytest.approx(1.0, abs=1e-4)
    assert (deviation[fields.slices["trust"]] == 1).all()
    with pytest.raises(ValueError, match="no field 'range_inovation'"):
        focus(envs, replace(recipe, focus={"range_inovation": 1.0}), columns, ones, ones)


def test_false_alarms_of_the_defender_cost_in_training_and_in_choosing_the_best() -> None:
    recipe = FdiDefense(num_envs=2, opponent="none")
    envs = make_envs(recipe, 2_000_000)
    envs.reset()
    doubt = np.repeat(envs.env.game.neutral_action["defender"][np.newaxis], 2, axis=0)
    doubt[0, :3] = 0
    _, own, _, _, _ = envs.env.step(doubt)
    cost = own - recipe.learned(envs.env.game, own, np.zeros(2, np.bool_))
    assert cost == pytest.approx([3 * recipe.false_alarm_cost_mps, 0])
    quiet = {"return": np.array([0.2, 0.4]), "false_alarm_rate": np.zeros(2)}
    noisy = {**quiet, "false_alarm_rate": np.array([0.0, 0.02])}
    assert recipe.score(quiet) == pytest.approx(-0.3)
    assert recipe.score(noisy) < recipe.score(quiet)
