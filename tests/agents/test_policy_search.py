"""Policy search as a learner: whole runs, interrupted ones, damaged ones, and what they leave."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

pytest.importorskip("cma")

from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn, train_all
from cps_agents.learning.recipe import SEARCH, Recipe, Situation, changed
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.search import CHECKPOINT
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import load
from cps_agents.zoo.merging import merge
from cps_baselines.disbanding.string_controller import StringController
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import ConfigurationError, UntrustedCodeError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.disbanding.problem import DISBANDING
from tests.agents.command_line import refusal, succeeded

SHORT = {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0, "report": "safety"}
SCENES = (Situation(2, "lead"), Situation(1, "table_2_3", "easy", {"attack_budget": 2}))
RECIPE = Recipe(
    name="disbanding-cacc",
    problem="disbanding",
    role="defender",
    algorithm=SEARCH,
    family="disbanding-local",
    preset="paper",
    overrides=SHORT,
    opponent="lead",
    scenes=SCENES,
    population=6,
    total_steps=6 * 3 * 8,
    evaluations=3,
    evaluation_episodes=3,
    search_deviation=0.2,
)


def job(folder: Path, recipe: Recipe = RECIPE, **changes: Any) -> TrainingJob:
    return TrainingJob(recipe, changes.pop("seed", 0), folder, "cps-envs train", **changes)


def numbers(folder: Path) -> np.ndarray:
    return load(folder / "policy.json")[1].tensors()["numbers"]


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
    assert (run["status"], run["steps"]) == ("finished", RECIPE.total_steps)
    assert run["cpu_s"] > 0
    scores = [row["validation"] for row in rows(whole)]
    assert [row["steps"] for row in rows(whole)] == [0, 36, 72, 108, 144]
    assert run["best_score"] == max(scores) > scores[0]
    card = read_card(whole / "policy.json")
    assert (card.family, card.head, card.algorithm) == ("disbanding-local", "family", "cma-es")
    assert card.numbers[0] == "leader.gap"
    assert card.numbers[-1] == "other.predecessor_command"
    assert card.seeds["0"]["validation"] == max(scores)


def test_a_found_policy_plays_by_its_name(whole: Path) -> None:
    config = DISBANDING.config("paper", SHORT)
    spec = DISBANDING.game(config, 1).spec("defender")
    policy = resolve_policy(f"zoo:{whole}", spec)
    assert isinstance(policy, StringController)
    found = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": f"zoo:{whole}"}, [0, 1])
    none = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": "none"}, [0, 1])
    assert np.all(found["velocity_error_all"] < none["velocity_error_all"])
    with pytest.raises(ConfigurationError, match="defender of disbanding, not as attacker"):
        resolve_policy(f"zoo:{whole}", DISBANDING.game(config, 1).spec("attacker"))


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
    import cps_agents.learning.search as module

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


def copied(whole: Path, folder: Path, **changes: Any) -> Path:
    """A card with changes beside the weights."""
    card = json.loads((whole / "policy.json").read_text())
    path = folder / "policy.json"
    path.write_text(json.dumps({**card, **changes}))
    path.with_suffix(".safetensors").write_bytes((whole / "policy.safetensors").read_bytes())
    return path


def test_damaged_numbers_are_refused(whole: Path, tmp_path: Path) -> None:
    names = read_card(whole / "policy.json").numbers
    with pytest.raises(ValueError, match="each its own"):
        load(copied(whole, tmp_path, numbers=[*names[:-1], names[0]]))
    with pytest.raises(ValueError, match="no other, has numbers"):
        load(copied(whole, tmp_path, family=""))
    with pytest.raises(ValueError, match="the card names 25"):
        load(copied(whole, tmp_path, numbers=names[:-1]))
    for wrong, told in (
        ({"0/numbers": np.full(26, np.nan)}, "not finite"),
        ({"0/numbers": np.full(26, 1e9)}, "far too large"),
        ({"0/numbers": np.zeros(26, np.float32)}, "float32"),
        ({"0/others": np.zeros(26)}, "one array"),
    ):
        path = copied(whole, tmp_path, weights="")
        save_file(wrong, path.with_suffix(".safetensors"))
        with pytest.raises(ValueError, match=told):
            load(path)
    path = copied(whole, tmp_path)
    save_file(
        {"0/numbers": 2.0 * load_file(whole / "policy.safetensors")["0/numbers"]}, path.with_suffix(".safetensors")
    )
    with pytest.raises(ValueError, match="not the weights that the card was written for"):
        load(path)


def test_a_card_cannot_bring_code_or_other_numbers(whole: Path, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.delenv("CPS_ENVS_TRUST", raising=False)
    spec = DISBANDING.game(DISBANDING.config("paper", SHORT), 1).spec("defender")
    path = copied(whole, tmp_path, family="os:system")
    with pytest.raises(UntrustedCodeError):
        resolve_policy(f"zoo:{path}", spec)
    names = read_card(whole / "policy.json").numbers
    path = copied(whole, tmp_path, numbers=["other", *names[1:]])
    with pytest.raises(ConfigurationError, match="other numbers than the family"):
        resolve_policy(f"zoo:{path}", spec)


def test_seeds_become_one_policy(whole: Path, tmp_path: Path) -> None:
    second = tmp_path / "seed-1"
    (found,) = train_all([job(second, seed=1)], 1, "tiny")
    assert found["status"] == "finished"
    assert not np.array_equal(numbers(second), numbers(whole))
    merged = merge([whole / "policy.json", second / "policy.json"], tmp_path / "both.json")
    assert list(merged.seeds) == ["0", "1"]
    spec = DISBANDING.game(DISBANDING.config("paper", SHORT), 1).spec("defender")
    policies = [resolve_policy(f"zoo:{tmp_path / 'both.json'}?seed={seed}", spec) for seed in (0, 1)]
    feeds = [policy.gains[0, 1, -1] for policy in policies if isinstance(policy, StringController)]
    np.testing.assert_array_equal(feeds, [numbers(folder)[-1] for folder in (whole, second)])


def test_commands(tmp_path: Path) -> None:
    scenes = 'scenes=[{"episodes": 1, "opponent": "none", "overrides": {"duration_s": 2}}]'
    few = ("--steps", "8", "--knob", "population=4", "--knob", "evaluation_episodes=1", "--knob", scenes)
    base = ("train", "RogueAttack-v0", "--algo", "cma-es", "--name", "tiny", "--seeds", "1", "--out", str(tmp_path))
    assert "add --knob family=NAME" in refusal(*base, *few)
    trained = succeeded(*base, *few, "--preset", "paper", "--knob", "family=rogue-switching")
    assert "seed 0: validation" in trained.stderr
    printed = succeeded("zoo", "show", str(tmp_path / "tiny" / "seed-0")).stdout
    assert "front_gap" in printed
    assert "hysteresis" in printed


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
    assert (again / "policy.safetensors").read_bytes() == (first / "policy.safetensors").read_bytes()
    assert rows(again) == rows(first)
