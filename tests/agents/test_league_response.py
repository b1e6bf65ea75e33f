"""Best responses: recipes against mixed strategies, and what a response is worth."""

from __future__ import annotations

import json
import signal
import zlib
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league import exploitability
from cps_agents.league.exploitability import Judgement, gain_over, judge, league_value, line_up_known
from cps_agents.league.league import asked, play_league
from cps_agents.league.oracles import SEARCHES, Oracle, choose_oracles, in_venue, usual_recipe
from cps_agents.league.report import document
from cps_agents.league.response import Budget, Question, Response, Responses, against, limited, respond
from cps_agents.league.strategy import mix
from cps_agents.league.venues import merged, venue_against
from cps_agents.learning import learner
from cps_agents.learning.recipe import SHARED, UNBOUNDED, Recipe, changed
from cps_agents.learning.shared import make_learner
from cps_agents.recipes.finding import find_recipe
from cps_envs import find_problem
from cps_envs.core.declare.training import Training
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.types import ROLES, Role
from tests.agents.command_line import invoke, refusal, succeeded
from tests.agents.trained import save_tiny
from tests.episodes import play

VENUE = Venue("rogue", "easy", {"duration_s": 3.0})


def returns(attacker: str, defender: str, seeds: range) -> np.ndarray[Any, Any]:
    return play(find_problem("rogue"), attacker, defender, seeds, "easy", duration_s=3.0)["return"]


def silent(done: int, total: int, label: str) -> None:
    pass


def answered(*references: str) -> Responses:
    return Responses(tuple(Response("ppo", k, name, 7, 1.0, -float(k)) for k, name in enumerate(references)))


def drawn_pays(draw: int, attacker: str, defender: str, start: int, episodes: int) -> Any:
    """What a pair's episodes pay, drawn instead of played."""
    return np.random.default_rng([draw, zlib.crc32(f"{attacker} {defender}".encode()), start]).normal(size=episodes)


@pytest.mark.parametrize("draw", range(4))
@pytest.mark.parametrize("role", ROLES)
def test_validation_chooses_the_best_of_all_and_fresh_episodes_judge_it(
    role: Role, draw: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def played(table: Table, *_: Any) -> Any:
        rows = [[(a.reference, d.reference) for d in table.defenders] for a in table.attackers]
        last = table.first_seed, table.episodes
        return SimpleNamespace(values=np.array([[drawn_pays(draw, *pair, *last) for pair in row] for row in rows]))

    monkeypatch.setattr(exploitability, "play_table", played)
    mine, theirs = (["square", "switching"], ["pd", "sliding"])[:: 1 if role == "attacker" else -1]
    question = Question(role, mix(theirs, [1, 3]), VENUE, episodes=4)
    present, left_out = line_up_known(question, mine, Store(tmp_path), 1)
    found = judge(question, present, left_out, answered(mine[0], "none"), Store(tmp_path), 1, silent)
    sign = 1 if role == "attacker" else -1

    def expected(name: str, start: int) -> Any:
        pairs = [(name, rival) if role == "attacker" else (rival, name) for rival in theirs]
        first, second = (drawn_pays(draw, *pair, start, 4) for pair in pairs)
        return 0.25 * first + 0.75 * second

    validation = {name: expected(name, 1_000_000).mean() for name in (*mine, "none")}
    assert found.known == max(mine, key=lambda name: sign * validation[name])
    response = max((mine[0], "none"), key=lambda name: sign * validation[name])
    assert found.response == f"ppo, seed {(mine[0], 'none').index(response)}"
    assert found.response_pay == estimate([expected(response, 0)[None]])
    assert found.known_pay == estimate([expected(found.known, 0)[None]])
    assert found.gain == estimate([sign * (expected(response, 0) - expected(found.known, 0))[None]])
    both = {found.response: found.response_pay, found.known: found.known_pay}
    assert sign * found.pay.mean == max(sign * each.mean for each in both.values())  # the worst of what is shown
    assert found.pay == both[found.best]
    paid = [sign * each.mean for each in found.validation.values()]
    assert paid == sorted(paid, reverse=True)
    assert len(paid) == 4


@pytest.mark.parametrize("role", ROLES)
def test_pays_of_a_judgement_are_those_of_its_episodes(role: Role, tmp_path: Path) -> None:
    mine, theirs = ("square", ["pd", "sliding"]) if role == "attacker" else ("pd", ["square", "switching"])
    question = Question(role, mix(theirs, [1, 3]), VENUE, episodes=4)
    present, left_out = line_up_known(question, [mine], Store(tmp_path), 1)
    found = judge(question, present, left_out, answered("none"), Store(tmp_path), 1, silent)
    for name, pay in (("none", found.response_pay), (mine, found.known_pay)):
        pairs = [(name, rival) if role == "attacker" else (rival, name) for rival in theirs]
        first, second = (returns(*pair, range(4)) for pair in pairs)
        assert pay.mean == pytest.approx((0.25 * first + 0.75 * second).mean())


def test_known_policies_that_cannot_play_are_left_out_with_the_reason(tmp_path: Path) -> None:
    question = Question("defender", mix(["square"]), VENUE, episodes=1)
    present, left_out = line_up_known(question, ["pd", "disband_2?number=-3"], Store(tmp_path), 1)
    assert [each.name for each in present.defenders] == ["pd"]
    assert list(left_out) == ["disband_2?number=-3"]


def test_a_response_is_the_best_only_where_it_gains() -> None:
    one, two = Estimate(3.0, 2.0, 4.0, 1, 9), Estimate(5.0, 4.0, 6.0, 1, 9)
    for gain, best in ((0.1, ("new", one)), (0.0, ("old", two)), (-0.1, ("old", two))):
        found = Judgement({}, "new", "old", one, two, Estimate(gain, None, None, 1, 1), {})
        assert (found.best, found.pay) == best


def test_an_opponent_that_cannot_play_is_an_error(tmp_path: Path) -> None:
    question = Question("attacker", mix(["pd", "disband_2?number=-3"]), VENUE, episodes=1)
    with pytest.raises(CommandError, match=r"opponent 'disband_2\?number=-3' cannot play"):
        line_up_known(question, ["square"], Store(tmp_path), 1)


def test_a_response_is_looked_for_where_the_opponent_learned(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "fdi", "defender", overrides={"correction_levels": 2, "disturbance_mps2": 0.3})
    strategy, usual = mix(["random", f"zoo:{tmp_path}/tiny.json"]), usual_recipe("fdi", "attacker")
    venue = venue_against(strategy, usual, None, {})
    assert (venue.preset, venue.overrides["disturbance_mps2"]) == ("paper", 0.3)
    assert venue_against(strategy, usual, None, {"disturbance_mps2": 0.2}).overrides["disturbance_mps2"] == 0.2
    chosen = venue_against(strategy, usual, "easy", {})
    assert (chosen.preset, chosen.overrides) == ("easy", {})
    (ppo,) = in_venue(choose_oracles("fdi", "attacker"), chosen, {})
    tuned = against(ppo.recipes[0], Question("attacker", strategy, chosen, 1), "response")
    assert (tuned.preset, tuned.overrides["correction_levels"]) == ("easy", 2)
    assert mix([tuned.training.opponent]).policies == strategy.policies
    assert venue_against(mix(["random"]), usual, None, {}).preset == usual.preset
    with pytest.raises(CommandError, match="choose one with --set a="):
        merged([{"a": 1, "b": 2}, {"b": 2, "a": 3}], "a recipe")


def test_our_own_ppo_is_the_usual_oracle_and_others_are_named() -> None:
    (usual,) = choose_oracles("hvac", "defender")
    assert (usual.name, usual.recipes) == (SHARED, (find_recipe("hvac-defense"),))
    (search,) = choose_oracles("hvac", "attacker", [SEARCHES])
    families = {recipe.family for recipe in search.recipes}
    assert families == {"hvac-tracker", "hvac-tracker-warm", "hvac-brink", "hvac-brink-warm"}
    (named,) = choose_oracles("fdi", "attacker", ["fdi-attack", "FdiDefense-v0"])
    assert named.recipes == (find_recipe("fdi-attack"),)
    for name, message in (
        ("serch", "Did you mean 'search'"),
        ("hvac-attack", "not one of fdi"),
        ("fdi-defense", "no oracle fdi-defense: shared-ppo is there for all roles"),
    ):
        with pytest.raises(CommandError, match=message):
            choose_oracles("fdi", "attacker", [name])


def test_learning_goes_on_with_the_best_known_network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = changed(usual_recipe("tests.agents.arms:ARMS", "attacker"), {"hidden": (16, 16), "evaluations": 1})
    venue = Venue("tests.agents.arms:ARMS", "learning", {})
    question = Question("attacker", mix(["none"]), venue, episodes=2, known=("none",))
    budget = Budget(1, 1, "cps-envs best-response", steps=6_400)
    store = Store(tmp_path / "meetings")
    first = respond([Oracle(SHARED, (recipe,))], question, tmp_path / "a", budget, store, "test").chosen
    assert first.validation > 15
    again = replace(question, known=("none", first.reference))
    second = respond([Oracle(SHARED, (recipe,))], again, tmp_path / "b", budget, store, "test").chosen
    run = json.loads((tmp_path / "b" / SHARED / "seed-0" / "run.json").read_text())
    assert run["recipe"]["start"] == first.reference
    rows = (tmp_path / "b" / SHARED / "seed-0" / "evaluations.jsonl").read_text().splitlines()
    assert json.loads(rows[0])["validation"] == first.validation  # before it has learned anything
    assert second.validation >= first.validation
    narrow = changed(recipe, {"hidden": (8, 8)})
    respond([Oracle(SHARED, (narrow,))], again, tmp_path / "c", replace(budget, steps=640), store, "test")
    assert not json.loads((tmp_path / "c" / SHARED / "seed-0" / "run.json").read_text())["recipe"]["start"]
    with pytest.raises(CommandError, match=r"start = .* is no network of shared-ppo"):
        make_learner(replace(narrow, start=first.reference), 0)


@pytest.mark.slow
def test_oracles_that_cannot_are_left_out_and_validation_chooses(tmp_path: Path) -> None:
    pytest.importorskip("cma")
    searching = choose_oracles("rogue", "attacker", [SEARCHES])
    gone = Recipe(name="x", problem="rogue", overrides=VENUE.overrides, training=Training(adapter="gone"))
    broken = Oracle("broken", (gone,))
    question = Question("attacker", mix(["pd"]), VENUE, episodes=3)
    told: list[str] = []
    budget = Budget(2, 1, "cps-envs best-response", steps=30)
    found = respond([*searching, broken], question, tmp_path / "a", budget, Store(tmp_path / "m"), "test", told.append)
    assert [each.seed for each in found.found] == [0, 1]
    assert found.chosen.validation == max(each.validation for each in found.found)
    assert list(found.left_out) == ["broken"]
    assert told[0].startswith("Left out: broken: ")
    assert all(each.reference.startswith(("strike?", "tuned?")) for each in found.found)
    again = respond(searching, question, tmp_path / "a", budget, Store(tmp_path / "m"), "test")
    assert again.found == found.found  # kept, and so not searched again
    with pytest.raises(CommandError, match=r"no oracle of the attacker has found a response\. broken: "):
        respond([broken], question, tmp_path / "c", budget, Store(tmp_path / "m"), "test")


def test_gains_over_a_league_count_both_intervals(tmp_path: Path) -> None:
    references: dict[Role, list[str]] = {"attacker": ["square"], "defender": ["pd"]}
    found = play_league(asked(VENUE, references, 3), references, Store(tmp_path / "cells"), 1)
    path = tmp_path / "league.json"
    path.write_text(json.dumps(document(found, {}, 0.0)))
    value = league_value(path, VENUE)
    assert value.mean == pytest.approx(returns("square", "pd", range(3)).mean())
    league = json.loads(path.read_text())
    written = league["equilibrium"]
    assert (value.low, value.high, value.seeds, value.episodes) == (written["low"], written["high"], 1, 3)
    assert written["low"] < written["value"] < written["high"]
    with pytest.raises(CommandError, match="other duration_s"):
        league_value(path, Venue("rogue", "easy", {"duration_s": 4.0}))
    with pytest.raises(CommandError, match="play the league first"):
        league_value(tmp_path / "none.json", VENUE)
    league["config"]["control_period_s"] = 9.0  # a form of acting, which makes no other game
    for other_game, refused in (
        ({"episodes": 1_000_000}, None),
        ({"episodes": 1_000_001}, "whole number from 1 to 1000000"),
        ({"metric": "damage"}, r"another game \(rogue, metric damage\)"),
        ({"problem": "fdi"}, r"another game \(fdi, metric return\)"),
    ):
        path.write_text(json.dumps(league | other_game))
        with pytest.raises((CommandError, DamagedFileError), match=refused) if refused else nullcontext():
            assert league_value(path, VENUE).mean == value.mean
    path.write_text(json.dumps(league | {"equilibrium": written | {"low": None, "high": None}}))
    assert league_value(path, VENUE).low is None
    response = Estimate(5.0, 4.0, 7.0, 1, 3)
    assert gain_over(Estimate(2.0, 1.0, 3.0, 1, 3), response, "attacker") == Estimate(3.0, 1.0, 6.0, 1, 3)
    assert gain_over(Estimate(9.0, 8.0, 9.5, 1, 3), response, "defender") == Estimate(4.0, 1.0, 5.5, 1, 3)
    for one, other in (((None, None), (1.0, 2.0)), ((1.0, 2.0), (None, None)), ((1.0, None), (1.0, 2.0))):
        found_gain = gain_over(Estimate(9.0, *one, 1, 3), Estimate(9.0, *other, 1, 3), "defender")
        assert (found_gain.low, found_gain.high) == (None, None)


TINY = (
    *("--set", "duration_s=3", "--steps", "640", "--jobs", "1", "--episodes", "2", "--knob", "num_envs=4"),
    *("--knob", "n_steps=16", "--knob", "batch_size=32", "--knob", "evaluations=1"),
    *("--knob", "evaluation_episodes=2", "--knob", "hidden=[8,8]", "--knob", "adapter=vehicle"),
)


def test_the_command_trains_and_judges(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    base = ("best-response", "rogue", "defender", "--attacker", "square", "--attacker", "none", "--weights", "3,1")
    where = ("--oracle", SHARED, "--seeds", "2", "--known", "pd", "--known", "sliding", "--out", str(tmp_path))
    found = json.loads(succeeded(*base, *TINY, *where, "--json").stdout)
    assert found["opponent"] == {"square": 0.75, "none": 0.25}
    assert [each["seed"] for each in found["responses"]] == [0, 1]
    assert found["budget"]["steps"] >= 2 * 640
    assert set(found["judgement"]["validation"]) == {"pd", "sliding", "shared-ppo, seed 0", "shared-ppo, seed 1"}
    assert found["chosen"]["validation"] == max(each["validation"] for each in found["responses"])
    assert found["reference"] == f"zoo:{tmp_path.resolve()}/shared-ppo/seed-{found['chosen']['seed']}"
    assert json.loads((tmp_path / "best-response.json").read_text()) == found
    printed = succeeded(*base, *TINY, *where, "--resume").stdout
    assert "The best defence found is" in printed
    assert "return, fresh episodes" in printed
    assert "another recipe" in refusal(*base, *TINY, *where, "--set", "duration_s=4")


def test_a_terminated_response_says_so_and_leaks_no_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")

    def terminating(progress: Any, job: Any, before: Any) -> Any:
        return lambda steps, note: signal.raise_signal(signal.SIGTERM) if steps else None

    monkeypatch.setattr(learner, "_counting", terminating)
    base = ("best-response", "rogue", "defender", "--attacker", "square", "--oracle", SHARED, "--known", "pd")
    stopped = invoke(*base, *TINY, "--out", str(tmp_path))
    assert stopped.exit_code == 143
    assert "Warning" not in stopped.stderr
    assert json.loads((tmp_path / SHARED / "seed-0" / "run.json").read_text())["status"] == "interrupted"


def test_a_budget_bounds_search_and_learning_together() -> None:
    recipe = find_recipe("fdi-attack")
    assert limited(recipe, 200).training.total_timesteps == 200
    assert (limited(recipe, None).most_cpu_s, limited(recipe, None, 3.0).most_cpu_s) == (60, 3)
    (search,) = choose_oracles("hvac", "attacker", [SEARCHES])
    shared = limited(search.recipes[0], None, 8.0, sharing=4)
    assert (shared.training.total_timesteps, shared.most_cpu_s) == (UNBOUNDED, 2.0)
    searched = changed(search.recipes[0], {"total_timesteps": 9_000})
    assert limited(searched, None) == searched
    assert limited(searched, 10 * 719 * 2).training.total_timesteps in (
        20,
        21,
    )  # episodes of 719 decisions and a little
