"""Best responses: recipes against mixed strategies, and what a response is worth."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")

from cps_agents.arena.statistics import Estimate
from cps_agents.arena.store import Store
from cps_agents.cli import main
from cps_agents.errors import CommandError
from cps_agents.league.exploitability import Contest, LeagueValue, gain_over, judge, league_value
from cps_agents.league.league import Plan, play_league
from cps_agents.league.report import document
from cps_agents.league.response import Trained, against, differing_presets, limited, merged, recipe_of, venue_of
from cps_agents.league.strategy import mix, strategy_of
from cps_agents.learning.recipe import Recipe
from cps_agents.recipes.finding import find_recipe
from cps_baselines.arena import Venue
from cps_envs import find_problem
from cps_envs.core.play import play_episodes
from cps_envs.core.types import Role
from tests.agents.trained import save_tiny

VENUE = Venue("rogue", "easy", {"duration_s": 3.0})
RECIPE = Recipe(name="tiny", problem="rogue", overrides=VENUE.overrides)
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(name="run")
def _run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["cps-envs", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return run


def returns(attacker: str, defender: str, episodes: int) -> np.ndarray[Any, Any]:
    players: Any = {"attacker": attacker, "defender": defender}
    return play_episodes(find_problem("rogue"), VENUE.config, players, range(episodes))["return"]


def silent(done: int, total: int, label: str) -> None:
    pass


@pytest.mark.parametrize("role", ["attacker", "defender"])
def test_a_response_is_worth_its_weighted_payoff(role: Role, tmp_path: Path) -> None:
    mine, theirs = (["square", "switching"], ["pd", "sliding"])[:: 1 if role == "attacker" else -1]
    contest = Contest(VENUE, role, mix(theirs, [1, 3]), mine, episodes=4)
    trained = Trained({3: mine[0], 5: "none"}, {3: 1.0, 5: 0.5}, steps=7, cpu_s=1.0)
    found = judge(contest, trained, Store(tmp_path), 1, silent)

    def expected(name: str) -> Any:
        pairs = [(name, rival) if role == "attacker" else (rival, name) for rival in theirs]
        return 0.25 * returns(*pairs[0], 4) + 0.75 * returns(*pairs[1], 4)

    assert found.response.mean == pytest.approx(expected(mine[0]).mean())
    assert found.all_seeds.mean == pytest.approx((expected(mine[0]).mean() + expected("none").mean()) / 2)
    means = {name: expected(name).mean() for name in mine}
    best = (max if role == "attacker" else min)(means, key=lambda name: means[name])
    assert found.best_known == best
    sign = 1 if role == "attacker" else -1
    assert found.gain.mean == pytest.approx(sign * (means[mine[0]] - means[best]), abs=1e-12)
    assert found.gain.mean <= 0


def test_an_opponent_that_cannot_play_is_an_error(tmp_path: Path) -> None:
    contest = Contest(VENUE, "attacker", mix(["pd", "disband_2?number=-3"]), ["square"], episodes=1)
    with pytest.raises(CommandError, match=r"opponent 'disband_2\?number=-3' cannot play"):
        judge(contest, Trained({0: "square"}, {0: 1.0}, 1, 1.0), Store(tmp_path), 1, silent)


def test_a_recipe_takes_the_strategy_and_the_forms_of_its_policies(tmp_path: Path) -> None:
    save_tiny(tmp_path / "share.json", "fdi", "attacker", overrides={"attack_action": "share"})
    recipe = recipe_of("fdi", "defender")
    assert recipe.role == "defender"
    tuned = against(recipe, mix(["random", f"zoo:{tmp_path}/share.json"]), total_steps=5)
    assert tuned.overrides == {**recipe.overrides, "attack_action": "share"}
    assert (tuned.evaluation_metric, tuned.total_steps) == ("return", 5)
    assert strategy_of(tuned.opponent).policies == ("random", f"zoo:{tmp_path}/share.json")
    assert venue_of(tuned).overrides == tuned.overrides
    with pytest.raises(CommandError, match="choose one with --set a="):
        merged([{"a": 1, "b": 2}, {"b": 2, "a": 3}], "a recipe")


def test_a_recipe_has_to_fit() -> None:
    with pytest.raises(CommandError, match="trains the attacker of fdi, not the defender"):
        recipe_of("fdi", "defender", "FdiAttack-v0")


def test_gains_over_a_league_count_both_intervals(tmp_path: Path) -> None:
    found = play_league(Plan(VENUE, {"attacker": ["square"], "defender": ["pd"]}, 3), Store(tmp_path / "cells"), 1)
    path = tmp_path / "league.json"
    path.write_text(json.dumps(document(found, {}, 0.0)))
    value = league_value(path, VENUE)
    assert value.mean == pytest.approx(returns("square", "pd", 3).mean())
    assert value.low is not None
    with pytest.raises(CommandError, match="other duration_s"):
        league_value(path, Venue("rogue", "easy", {"duration_s": 4.0}))
    with pytest.raises(CommandError, match="play the league first"):
        league_value(tmp_path / "none.json", VENUE)
    response = Estimate(5.0, 4.0, 7.0, 1, 3)
    assert gain_over(LeagueValue(2.0, 1.0, 3.0), response, "attacker") == Estimate(3.0, 1.0, 6.0, 1, 3)
    assert gain_over(LeagueValue(9.0, 8.0, 9.5), response, "defender") == Estimate(4.0, 1.0, 5.5, 1, 3)
    assert gain_over(LeagueValue(9.0, None, None), response, "defender").low is None


TINY = (
    *("--set", "duration_s=3", "--steps", "64", "--jobs", "1", "--episodes", "2", "--knob", "num_envs=4"),
    *("--knob", "steps_per_update=16", "--knob", "batch_size=32", "--knob", "evaluations=1"),
    *("--knob", "evaluation_episodes=2", "--knob", "hidden=[8]", "--knob", "teacher_episodes=2"),
)


def test_the_command_trains_and_judges(tmp_path: Path, run: Run) -> None:
    pytest.importorskip("sb3_contrib")
    base = ("best-response", "rogue", "defender", "--against", "square", "--against", "none", "--weights", "3,1")
    where = ("--seeds", "2", "--known", "pd", "--known", "sliding", "--out", str(tmp_path))
    code, printed, told = run(*base, *TINY, *where, "--json")
    assert code == 0, told
    found = json.loads(printed)
    assert found["opponent"] == {"square": 0.75, "none": 0.25}
    assert found["budget"]["seeds"] == 2
    assert found["budget"]["steps"] >= 2 * 64
    assert set(found["known"]) == {"pd", "sliding"}
    assert found["validation"][str(found["chosen_seed"])] == max(found["validation"].values())
    assert found["reference"] == f"zoo:{tmp_path.resolve()}/seed-{found['chosen_seed']}"
    assert json.loads((tmp_path / "best-response.json").read_text()) == found
    code, printed, _ = run(*base, *TINY, *where, "--resume")
    assert code == 0
    assert "Budget: 2 seeds" in printed
    code, _, told = run(*base, *TINY, *where, "--set", "duration_s=4")
    assert code == 2
    assert "another recipe" in told


def test_mistakes_are_told_before_training(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    base = ("best-response", "rogue", "attacker", "--against", "pd", "--out", str(tmp_path))
    for arguments, message in (
        (("--weights", "a"), "write numbers with commas"),
        (("--weights", "1,2"), "one weight for each policy"),
        (("--league", "nowhere.json"), "play the league first"),
        (("--recipe", "FdiAttack-v0"), "trains the attacker of fdi"),
    ):
        code, _, told = run(*base, *arguments)
        assert code == 2
        assert message in told.replace("\n", " ")
    code, _, told = run("best-response", "rogue", "atacker", "--against", "pd")
    assert (code, "not a role" in told) == (2, True)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    code, _, told = run(*base)
    assert code == 2
    assert 'pip install "cps-envs[train]"' in told.replace("\n", " ")
    assert not list(tmp_path.iterdir())


def test_a_budget_bounds_search_and_learning_together() -> None:
    recipe = replace(find_recipe("fdi-attack-ppo"), search_steps=3_000, total_steps=1_000)
    found = limited(recipe, 200)
    assert (found.search_steps, found.total_steps) == (150, 50)
    assert limited(recipe, None) == recipe
    assert limited(replace(recipe, search_steps=0), 7).total_steps == 7


def test_another_preset_of_the_opponent_is_noticed() -> None:
    recipe = find_recipe("fdi-attack-ppo")
    strategy = mix(["zoo:fdi-defense-ppo", "model"])
    assert differing_presets(recipe, strategy) == ["zoo:fdi-defense-ppo (defense)"]
