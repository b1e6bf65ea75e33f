"""Best responses: recipes against mixed strategies, and what a response is worth."""

from __future__ import annotations

import json
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")

from cps_agents.arena.statistics import Estimate
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.exploitability import LeagueValue, gain_over, judge, league_value
from cps_agents.league.league import Plan, play_league
from cps_agents.league.oracles import (
    Oracle,
    SearchJob,
    choose_oracles,
    in_venue,
    merged,
    oracles_of,
    other_presets,
    usual_of,
    venue_against,
)
from cps_agents.league.report import document
from cps_agents.league.response import Budget, Question, Response, Responses, against, limited, respond
from cps_agents.league.strategy import mix, strategy_of
from cps_agents.learning import learner
from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.recipes.finding import find_recipe
from cps_baselines.arena import Venue
from cps_baselines.contest import Search
from cps_envs import find_problem
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.play import play_episodes
from cps_envs.core.types import Role
from tests.agents.command_line import run
from tests.agents.trained import save_tiny

VENUE = Venue("rogue", "easy", {"duration_s": 3.0})


def returns(attacker: str, defender: str, episodes: int) -> np.ndarray[Any, Any]:
    players: Any = {"attacker": attacker, "defender": defender}
    return play_episodes(find_problem("rogue"), VENUE.config, players, range(episodes))["return"]


def silent(done: int, total: int, label: str) -> None:
    pass


def answered(*references: str) -> Responses:
    return Responses(tuple(Response("ppo", k, name, 7, 1.0, -float(k)) for k, name in enumerate(references)))


@pytest.mark.parametrize("role", ["attacker", "defender"])
def test_a_response_is_worth_its_weighted_payoff(role: Role, tmp_path: Path) -> None:
    mine, theirs = (["square", "switching"], ["pd", "sliding"])[:: 1 if role == "attacker" else -1]
    question = Question(role, mix(theirs, [1, 3]), VENUE, episodes=4)
    found = judge(question, mine, answered(mine[0], "none"), Store(tmp_path), 1, silent)

    def expected(name: str) -> Any:
        pairs = [(name, rival) if role == "attacker" else (rival, name) for rival in theirs]
        return 0.25 * returns(*pairs[0], 4) + 0.75 * returns(*pairs[1], 4)

    assert found.response.mean == pytest.approx(expected(mine[0]).mean())
    assert found.oracles["ppo"].mean == pytest.approx((expected(mine[0]).mean() + expected("none").mean()) / 2)
    means = {name: expected(name).mean() for name in mine}
    best = (max if role == "attacker" else min)(means, key=lambda name: means[name])
    assert found.best_known == best
    sign = 1 if role == "attacker" else -1
    assert found.gain.mean == pytest.approx(sign * (means[mine[0]] - means[best]), abs=1e-12)
    assert found.gain.mean <= 0


def test_an_opponent_that_cannot_play_is_an_error(tmp_path: Path) -> None:
    question = Question("attacker", mix(["pd", "disband_2?number=-3"]), VENUE, episodes=1)
    with pytest.raises(CommandError, match=r"opponent 'disband_2\?number=-3' cannot play"):
        judge(question, ["square"], answered("square"), Store(tmp_path), 1, silent)


def test_a_response_is_looked_for_where_the_opponent_learned(tmp_path: Path) -> None:
    save_tiny(tmp_path / "share.json", "fdi", "attacker", overrides={"attack_action": "share", "disturbance_mps2": 0.3})
    strategy, usual = mix(["random", f"zoo:{tmp_path}/share.json"]), find_recipe("fdi-defense-ppo")
    venue = venue_against(strategy, usual, None, {})
    assert (venue.preset, venue.overrides["disturbance_mps2"]) == ("paper", 0.3)
    assert venue_against(strategy, usual, None, {"disturbance_mps2": 0.2}).overrides["disturbance_mps2"] == 0.2
    chosen = venue_against(strategy, usual, "easy", {})
    assert (chosen.preset, chosen.overrides) == ("easy", {})
    (ppo,) = in_venue(choose_oracles("fdi", "defender", ["ppo"]), chosen, {})
    assert ppo.recipe is not None
    tuned = against(ppo.recipe, Question("defender", strategy, chosen, 1), "response")
    assert (tuned.preset, tuned.overrides["attack_action"]) == ("easy", "share")
    assert strategy_of(tuned.opponent).policies == strategy.policies
    assert venue_against(mix(["random"]), usual, None, {}).preset == usual.preset
    with pytest.raises(CommandError, match="choose one with --set a="):
        merged([{"a": 1, "b": 2}, {"b": 2, "a": 3}], "a recipe")


def test_a_recipe_of_another_preset_is_noticed() -> None:
    oracles = choose_oracles("fdi", "attacker", ["ppo", "search"])
    venue = venue_against(mix(["zoo:fdi-defense-ppo"]), usual_of(oracles, "fdi", "attacker"), None, {})
    assert venue.preset == "defense"
    assert other_presets(oracles, venue) == ["fdi-attack-ppo (easy)"]


def test_a_role_has_the_oracles_that_its_searches_families_and_recipes_make() -> None:
    names = {role: [oracle.name for oracle in choose_oracles("hvac", role)] for role in ("attacker", "defender")}
    assert names["attacker"][:4] == ["search", "hvac-brink", "hvac-tracker", "hvac-tracker-warm"]
    assert names["defender"] == ["search", "hvac-bayes", "hvac-bayes-together", "ppo"]
    assert "plans" in [oracle.kind for oracle in oracles_of("fdi", "attacker")]
    assert "recurrent" not in [oracle.kind for oracle in choose_oracles("rogue", "attacker")]
    (recurrent,) = choose_oracles("rogue", "attacker", ["recurrent"])
    assert recurrent.recipe == find_recipe("rogue-attack-recurrent")
    (named,) = choose_oracles("fdi", "attacker", ["fdi-attack-disturbed-ppo", "FdiDefense-v0"])
    assert named.recipe == find_recipe("fdi-attack-disturbed-ppo")
    for name, message in (
        ("serch", "Did you mean 'search'"),
        ("hvac-attack-ppo", "not one of fdi"),
        ("recurrent", "no oracle recurrent. It has: search"),
    ):
        with pytest.raises(CommandError, match=message):
            choose_oracles("fdi", "attacker", [name])


def test_searched_families_are_judged_by_what_they_are_paid() -> None:
    bayes = next(oracle for oracle in choose_oracles("hvac", "defender") if oracle.kind == SEARCH)
    (moved,) = in_venue([bayes], Venue("hvac", "learning"), {"population": 6})
    assert moved.recipe is not None
    recipe = against(
        moved.recipe, Question("defender", mix(["ramp", "none"]), Venue("hvac", "learning"), 1), "bayes-response"
    )
    assert (recipe.population, recipe.preset, len(recipe.scenes)) == (6, "learning", 1)
    assert recipe.opponent == recipe.scenes[0].opponent or not recipe.scenes[0].opponent
    assert recipe.values({"return": np.array([4.0])}) == [-4.0]  # and not its root


def test_a_teacher_is_kept_for_each_policy_of_a_mixture() -> None:
    recipe = find_recipe("rogue-attack-recurrent")
    venue = Venue("rogue", recipe.preset, recipe.overrides)
    tuned = against(recipe, Question("attacker", mix(["sliding", "pd"]), venue, 1), "response")
    assert set(tuned.teachers) == {"sliding", "pd"}
    with pytest.raises(CommandError, match="no teacher against"):
        against(recipe, Question("attacker", mix(["human"]), venue, 1), "response")


def test_oracles_that_cannot_are_left_out_and_validation_chooses(tmp_path: Path) -> None:
    pytest.importorskip("cma")
    searching = [oracle for oracle in choose_oracles("rogue", "attacker") if oracle.kind == "search"]
    broken = Oracle("ppo", "broken", Recipe(name="x", problem="rogue", algorithm="dqn", overrides=VENUE.overrides))
    question = Question("attacker", mix(["pd"]), VENUE, episodes=3)
    told: list[str] = []
    budget = Budget(2, 1, "cps-envs best-response", steps=30)
    found = respond([*searching, broken], question, tmp_path / "a", budget, Store(tmp_path / "m"), "test", told.append)
    assert [each.seed for each in found.found] == [0, 1]
    assert found.chosen.validation == max(each.validation for each in found.found)
    assert list(found.left_out) == ["broken"]
    assert told[0].startswith("Left out: broken: ")
    again = respond(searching, question, tmp_path / "b", budget, Store(tmp_path / "m"), "test")
    assert again.found == found.found  # kept, and so not searched again
    with pytest.raises(CommandError, match=r"no oracle of the attacker has found a response\. broken: "):
        respond([broken], question, tmp_path / "c", budget, Store(tmp_path / "m"), "test")


def test_a_search_goes_on_where_a_candidate_cannot_play() -> None:
    small = {"num_platoons": 3, "vehicles_per_platoon": 2, "duration_s": 5.0}
    venue = Venue("disbanding", "paper", small)
    some = Search("timed", "timed?jam=9", {"first": (1.0, 9.0)}, {"first": 1.0})  # nobody can jam here
    job = SearchJob(venue, "attacker", "none", some, 60.0, 1, 12, 1_000_000)
    found = job.run()
    assert found["score"] > 0
    assert found["candidates"] > 1
    none = replace(job, search=replace(some, ranges={"first": (4.0, 9.0)}, start={}))
    with pytest.raises(ConfigurationError, match="does not exist"):
        none.run()


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


def test_the_command_trains_and_judges(tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib")
    base = ("best-response", "rogue", "defender", "--against", "square", "--against", "none", "--weights", "3,1")
    where = ("--oracle", "ppo", "--seeds", "2", "--known", "pd", "--known", "sliding", "--out", str(tmp_path))
    code, printed, told = run(*base, *TINY, *where, "--json")
    assert code == 0, told
    found = json.loads(printed)
    assert found["opponent"] == {"square": 0.75, "none": 0.25}
    assert [each["seed"] for each in found["responses"]] == [0, 1]
    assert found["budget"]["steps"] >= 2 * 64
    assert set(found["judgement"]["known"]) == {"pd", "sliding"}
    assert found["chosen"]["validation"] == max(each["validation"] for each in found["responses"])
    assert found["reference"] == f"zoo:{tmp_path.resolve()}/ppo/seed-{found['chosen']['seed']}"
    assert json.loads((tmp_path / "best-response.json").read_text()) == found
    code, printed, _ = run(*base, *TINY, *where, "--resume")
    assert code == 0
    assert "oracle ppo, 2 seeds" in printed
    assert "pay, m/s" in printed
    code, _, told = run(*base, *TINY, *where, "--set", "duration_s=4")
    assert code == 2
    assert "another recipe" in told


def test_a_terminated_response_says_so_and_leaks_no_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sb3_contrib")

    def terminating(progress: Any, job: Any, before: Any) -> Any:
        return lambda steps, note: signal.raise_signal(signal.SIGTERM) if steps else None

    monkeypatch.setattr(learner, "_counting", terminating)
    base = ("best-response", "rogue", "defender", "--against", "square", "--oracle", "ppo", "--preset", "easy")
    code, _, told = run(
        *base, *TINY, "--steps", "128", "--knob", "batch_size=24", "--seeds", "1", "--out", str(tmp_path)
    )
    assert code == 143
    assert "Warning" not in told
    assert json.loads((tmp_path / "ppo" / "seed-0" / "run.json").read_text())["status"] == "interrupted"


def test_mistakes_are_told_before_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    base = ("best-response", "rogue", "attacker", "--against", "pd", "--out", str(tmp_path))
    for arguments, message in (
        (("--weights", "a"), "write numbers with commas"),
        (("--weights", "1,2"), "one weight for each policy"),
        (("--league", "nowhere.json"), "play the league first"),
        (("--oracle", "FdiAttack-v0"), "trains the attacker of fdi"),
    ):
        code, _, told = run(*base, *arguments)
        assert code == 2
        assert message in told.replace("\n", " ")
    code, _, told = run("best-response", "rogue", "atacker", "--against", "pd")
    assert (code, "not a role" in told) == (2, True)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    code, _, told = run(*base, "--oracle", "ppo")
    assert code == 2
    assert 'pip install "cps-envs[train]"' in told.replace("\n", " ")
    assert not list(tmp_path.rglob("run.json"))


def test_a_budget_bounds_search_and_learning_together() -> None:
    recipe = replace(find_recipe("fdi-attack-ppo"), search_steps=3_000, total_steps=1_000)
    found = limited(recipe, 200)
    assert (found.search_steps, found.total_steps) == (150, 50)
    assert limited(recipe, None) == recipe
    assert limited(recipe, None, 3.0).most_cpu_s == 3.0
    searched = replace(find_recipe("hvac-attack-cma"), total_steps=9_000)
    assert limited(searched, 10 * 719 * 2).total_steps in (20, 21)  # episodes of 719 decisions and a little
    assert limited(replace(recipe, search_steps=0), 7).total_steps == 7
