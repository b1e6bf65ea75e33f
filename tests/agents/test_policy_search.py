"""Policy search as a learner: whole runs, interrupted ones, damaged ones, and what they leave."""

from __future__ import annotations

import itertools
import json
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cma")

import cps_agents.learning.search as module
from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn, train_all
from cps_agents.learning.recipe import UNBOUNDED, Recipe, Situation, changed
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.search import CHECKPOINT, FOUND
from cps_baselines.disbanding.families import LOCAL
from cps_baselines.disbanding.string_controller import StringController
from cps_baselines.family import Family, between, play_family
from cps_envs.core.declare.seeds import TRAINING_START
from cps_envs.core.declare.training import Training
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.disbanding.problem import DISBANDING
from tests.agents.command_line import refusal, succeeded

SHORT = {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0, "report": "safety"}
SCENES = (Situation(2, "lead"), Situation(1, "table_2_3", "easy", {"attack_budget": 2}))
RECIPE = Recipe(
    name="cacc",
    problem="disbanding",
    role="defender",
    algorithm="cma-es",
    family="disbanding-local",
    preset="paper",
    overrides=SHORT,
    scenes=SCENES,
    population=6,
    training=Training(total_timesteps=6 * 3 * 8),
    evaluations=3,
    evaluation_episodes=3,
    search_deviation=0.2,
)


def job(folder: Path, recipe: Recipe = RECIPE, **changes: Any) -> TrainingJob:
    return TrainingJob(recipe, changes.pop("seed", 0), folder, "cps-envs train", **changes)


def found_in(folder: Path, name: str = "cacc") -> dict[str, Any]:
    """What a run has found."""
    entry: dict[str, Any] = json.loads((folder / FOUND).read_text())[name]
    return entry


def numbers(folder: Path, name: str = "cacc") -> np.ndarray:
    return np.array(list(found_in(folder, name)["numbers"].values()))


def rows(folder: Path) -> list[dict[str, Any]]:
    found = [json.loads(line) for line in (folder / "evaluations.jsonl").read_text().splitlines()]
    return [{name: value for name, value in row.items() if name != "cpu_s"} for row in found]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that was never stopped."""
    folder = tmp_path_factory.mktemp("whole")
    learn(job(folder))
    return folder


def test_a_run_leaves_a_better_policy_with_its_numbers(whole: Path) -> None:
    run = json.loads((whole / "run.json").read_text())
    assert (run["status"], run["steps"]) == ("finished", RECIPE.training.total_timesteps)
    assert run["cpu_s"] > 0
    scores = [row["validation"] for row in rows(whole)]
    assert [row["steps"] for row in rows(whole)] == [0, 36, 72, 108, 144]
    assert run["best_score"] == max(scores) > scores[0]
    found = found_in(whole)
    assert tuple(found["numbers"]) == LOCAL.names
    assert (found["seed"], found["validation"], found["command"]) == (0, max(scores), "cps-envs train")
    assert found["policy"] == run["policy"] == LOCAL.reference(numbers(whole))


def test_a_found_policy_plays_as_it_is_printed(whole: Path) -> None:
    config, reference = DISBANDING.config("paper", SHORT), found_in(whole)["policy"]
    policy = resolve_policy(reference, DISBANDING.game(config, 1).spec("defender"))
    assert isinstance(policy, StringController)
    found = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": reference}, [0, 1])
    none = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": "none"}, [0, 1])
    assert np.all(found["velocity_error_all"] < none["velocity_error_all"])
    values = np.repeat(numbers(whole)[np.newaxis], 2, axis=0)
    searched = play_family(LOCAL, DISBANDING, config, "lead", values, [0, 1])
    np.testing.assert_array_equal(searched["return"], found["return"])


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_search_goes_on_to_the_same_result(whole: Path, tmp_path: Path, stop: signal.Signals) -> None:
    def interrupt(steps: int, note: str) -> None:
        if steps == 54:
            signal.raise_signal(stop)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), interrupt)
    stopped = json.loads((tmp_path / "run.json").read_text())
    assert (stopped["status"], stopped["steps"]) == ("interrupted", 54)
    with pytest.raises(CommandError, match="--resume"):
        learn(job(tmp_path))
    found = learn(job(tmp_path, resume=True))
    assert found["status"] == "finished"
    assert found["cpu_s"] >= stopped["cpu_s"]
    np.testing.assert_array_equal(numbers(tmp_path), numbers(whole))
    assert rows(tmp_path) == rows(whole)
    assert (tmp_path / CHECKPOINT).read_text() == (whole / CHECKPOINT).read_text()
    assert learn(job(tmp_path, resume=True)) == found  # nothing left to do


def test_a_generation_that_was_cut_off_is_played_again(whole: Path, tmp_path: Path, monkeypatch: Any) -> None:
    play, calls = module.play_scenes, []

    def cut_off(*arguments: Any) -> Any:
        calls.append(arguments)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return play(*arguments)

    monkeypatch.setattr(module, "play_scenes", cut_off)
    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path))
    learn(job(tmp_path, resume=True))
    np.testing.assert_array_equal(numbers(tmp_path), numbers(whole))
    assert rows(tmp_path) == rows(whole)


def damaged(whole: Path, folder: Path, **changes: Any) -> TrainingJob:
    """A job to go on with from a damaged checkpoint."""
    kept = json.loads((whole / CHECKPOINT).read_text())
    (folder / CHECKPOINT).write_text(json.dumps({**kept, **changes}))
    run = json.loads((whole / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**run, "status": "interrupted"}))
    return job(folder, resume=True)


@pytest.mark.parametrize("reached", [[[1.0]], [[float("nan")] * 6], "text", [], {"a": 1}])
def test_a_damaged_checkpoint_is_named(whole: Path, tmp_path: Path, reached: Any) -> None:
    with pytest.raises((CommandError, DamagedFileError), match=r"generations\.json"):
        learn(damaged(whole, tmp_path, reached=reached))


def test_a_checkpoint_of_another_strategy_is_refused(whole: Path, tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="another version of cma"):
        learn(damaged(whole, tmp_path, mean=[0.0] * 26))


def test_recipes_that_cannot_be_searched_are_explained(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="names no family"):
        learn(job(tmp_path, replace(RECIPE, family="")))
    with pytest.raises(CommandError, match="attackers of rogue"):
        learn(job(tmp_path, replace(RECIPE, family="rogue-switching")))
    with pytest.raises(CommandError, match="population has to be at least 4"):
        replace(RECIPE, population=3)
    with pytest.raises(CommandError, match="scenes should be like"):
        changed(RECIPE, {"scenes": [{"episode": 2}]})
    with pytest.raises(CommandError, match="at least 1"):
        changed(RECIPE, {"scenes": [{"episodes": 0}]})
    assert changed(RECIPE, {"scenes": [{"episodes": 2}]}).scenes == (Situation(2),)


def test_seeds_are_searched_apart(whole: Path, tmp_path: Path) -> None:
    second = tmp_path / "seed-1"
    (found,) = train_all([job(second, seed=1)], 1, "tiny")
    assert found["status"] == "finished"
    assert not np.array_equal(numbers(second), numbers(whole))


HILLY = Recipe(name="hill", problem="rogue", algorithm="cma-es")
HILL = Family("rogue", "attacker", "strike", between({"strike_s": (0.5, 9.0), "effort": (-1.0, 1.0)}, effort=0.9))


@pytest.fixture
def climbing(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Policy search on a hill, whose top lies at 80 % of each range; the first seeds of what was played."""
    played: list[int] = []

    def climb(recipe: Recipe, family: Family, values: np.ndarray, first_seed: int, times: int = 1) -> np.ndarray:
        low, high = np.array([(number.low, number.high) for number in family.numbers]).T
        assert ((low <= values) & (values <= high)).all()
        if first_seed >= TRAINING_START:
            played.append(first_seed)
        return -np.square((values - low) / (high - low) - 0.8).sum(axis=1, keepdims=True)

    monkeypatch.setattr(module, "play_scenes", climb)
    monkeypatch.setattr(module, "family_of", lambda recipe: HILL)
    return played


def test_a_search_within_bounds_climbs_a_hill_and_begins_again_elsewhere(climbing: list[int], tmp_path: Path) -> None:
    recipe = replace(HILLY, population=8, training=Training(total_timesteps=8 * 16 * 200))
    found = learn(job(tmp_path, recipe))
    np.testing.assert_allclose(numbers(tmp_path, "hill"), [7.3, 0.6], atol=1e-3)
    assert found["policy"].startswith("strike?strike_s=7.")
    assert len(set(climbing)) == 200  # fresh episodes in each generation
    means = [row["validation"] for row in rows(tmp_path)]
    assert any(later < earlier - 0.01 for earlier, later in itertools.pairwise(means))


def test_cpu_time_ends_a_search_which_has_a_result_however_little_that_is(climbing: list[int], tmp_path: Path) -> None:
    recipe = replace(HILLY, training=Training(total_timesteps=UNBOUNDED), most_cpu_s=1e-9)
    assert learn(job(tmp_path, recipe))["policy"].startswith("strike?strike_s=")
    assert rows(tmp_path)[0] == {"steps": 0, "validation": pytest.approx(-(0.3**2) - 0.15**2)}  # where it begins
    assert len(climbing) < 200


def test_a_search_goes_on_where_a_candidate_cannot_play(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = {"num_platoons": 3, "vehicles_per_platoon": 2, "duration_s": 5.0}
    recipe = replace(RECIPE, name="timed", role="attacker", overrides=small, scenes=(Situation(1, "none"),))
    recipe = replace(recipe, search_deviation=0.4)
    some = Family("disbanding", "attacker", "timed?jam=9", between({"first": (1.0, 9.0)}, first=1.0))
    monkeypatch.setattr(module, "family_of", lambda recipe: some)  # nobody can jam here
    found = learn(job(tmp_path / "some", changed(recipe, {"total_timesteps": 12})))
    assert found["best_score"] > 0
    reached = json.loads((tmp_path / "some" / CHECKPOINT).read_text())["reached"]
    assert min(min(row) for row in reached) == module.REFUSED
    none = Family("disbanding", "attacker", "timed?jam=9", between({"first": (4.0, 9.0)}))
    monkeypatch.setattr(module, "family_of", lambda recipe: none)
    with pytest.raises(ConfigurationError, match="does not exist"):
        learn(job(tmp_path / "none", changed(recipe, {"total_timesteps": 12})))


def test_commands(tmp_path: Path) -> None:
    scenes = 'scenes=[{"episodes": 1, "opponent": "none", "overrides": {"duration_s": 2}}]'
    few = ("--steps", "8", "--knob", "population=4", "--knob", "evaluation_episodes=1", "--knob", scenes)
    base = ("train", "RogueAttack-v0", "--algo", "cma-es", "--name", "tiny", "--seeds", "1", "--out", str(tmp_path))
    assert "add --knob family=NAME" in refusal(*base, *few)
    trained = succeeded(*base, *few, "--preset", "paper", "--knob", "family=rogue-switching")
    assert "seed 0: validation" in trained.stderr
    assert "tuned?front_gap=" in trained.stderr
    reference = found_in(tmp_path / "tiny" / "seed-0", "tiny")["policy"]
    short = ("--preset", "paper", "--set", "duration_s=2", "--json")
    assert "return" in succeeded("play", "rogue", "--attacker", reference, *short).stdout
    assert "leave it out" in refusal(*base, *few, "--knob", "family=rogue-switching", "--to", str(tmp_path))


def test_a_search_is_repeated_exactly_by_its_record(tmp_path: Path) -> None:
    def train(*arguments: str) -> None:
        succeeded("train", *arguments, "--jobs", "1", "--tracker", "none")

    scenes = 'scenes=[{"episodes":2,"overrides":{"duration_s":3}}]'
    small = ("--knob", scenes, "--knob", "population=4", "--steps", "24")
    knobs = ("--algo", "cma-es", "--knob", "family=rogue-switching", "--knob", "evaluation_episodes=2")
    out = ("--name", "mine", "--preset", "easy", "--seeds", "1", "--first-seed", "3", "--out", str(tmp_path / "first"))
    train("RogueAttack-v0", *knobs, *small, *out)
    first, again = tmp_path / "first" / "mine" / "seed-3", tmp_path / "again" / "mine" / "seed-3"
    train("--config", str(first / "run.json"), "--out", str(tmp_path / "again"))
    assert found_in(again, "mine")["numbers"] == found_in(first, "mine")["numbers"]
    assert rows(again) == rows(first)
