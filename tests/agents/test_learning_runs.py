"""Training runs: whole, interrupted, resumed, damaged."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn, train_all
from cps_agents.learning.run import TrainingJob
from cps_agents.zoo.files import load
from cps_baselines.interruption import Ended
from cps_envs.core.documents import DamagedFileError
from tests.agents.command_line import run
from tests.agents.test_learning_parts import CASES, ROGUE, SWARM

RECIPE = replace(ROGUE, total_steps=128, evaluations=2, evaluation_episodes=2)


def job(folder: Path, recipe: Any = RECIPE, **changes: Any) -> TrainingJob:
    return TrainingJob(recipe, changes.pop("seed", 0), folder, "cps-envs train", **changes)


@pytest.mark.parametrize("case", CASES)
def test_a_run_leaves_a_policy_that_plays(case: str, tmp_path: Path) -> None:
    recipe = replace(
        CASES[case],
        total_steps=2 * 16 * 36 if case == "swarm" else 128,
        evaluations=1,
        evaluation_episodes=2,
        learning_starts=32,
    )
    found = learn(job(tmp_path, recipe))
    assert found["status"] == "finished"
    assert found["steps"] >= recipe.total_steps
    rows = [json.loads(line) for line in (tmp_path / "evaluations.jsonl").read_text().splitlines()]
    assert [row["steps"] for row in rows] == [0, found["steps"]]
    card, _ = load(tmp_path / "policy.json")
    assert card.seeds["0"]["validation"] == max(row["validation"] for row in rows)
    assert card.recipe["total_steps"] == recipe.total_steps
    assert list((tmp_path / "tensorboard").rglob("events*"))


def test_the_same_seed_gives_the_same_network(tmp_path: Path) -> None:
    for name in ("a", "b"):
        learn(job(tmp_path / name))
    first, second = (load(tmp_path / name / "policy.json")[1].tensors() for name in ("a", "b"))
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name])


def test_starts_from_a_teacher(tmp_path: Path) -> None:
    recipe = replace(
        SWARM,
        teacher="feedback",
        teacher_episodes=2,
        teacher_rounds=2,
        teacher_epochs=3,
        value_warm_up=1,
        total_steps=2 * 16 * 36,
        evaluations=1,
        evaluation_episodes=2,
    )
    assert learn(job(tmp_path, recipe))["status"] == "finished"


def test_an_interrupted_run_leaves_a_policy_and_goes_on(tmp_path: Path) -> None:
    long = replace(RECIPE, total_steps=640)

    def interrupt(steps: int, note: str) -> None:
        if steps >= 128:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path, long), interrupt)
    stopped = json.loads((tmp_path / "run.json").read_text())
    assert stopped["status"] == "interrupted"
    assert 128 <= stopped["steps"] < 640
    load(tmp_path / "policy.json")
    with pytest.raises(CommandError, match="--resume"):
        learn(job(tmp_path, long))
    found = learn(job(tmp_path, long, resume=True))
    assert (found["status"], found["steps"], found["resumptions"]) == ("finished", 640, 1)
    assert found["cpu_s"] >= stopped["cpu_s"]
    assert learn(job(tmp_path, long, resume=True)) == found  # nothing left to do


def test_termination_is_an_interruption(tmp_path: Path) -> None:
    def terminate(steps: int, note: str) -> None:
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), terminate)
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
    load(tmp_path / "policy.json")


def test_damaged_files_are_named(tmp_path: Path) -> None:
    def interrupt(steps: int, note: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), interrupt)
    whole = (tmp_path / "checkpoint.zip").read_bytes()
    (tmp_path / "checkpoint.zip").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CommandError, match=r"checkpoint\.zip is damaged"):
        learn(job(tmp_path, resume=True))
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(DamagedFileError, match=r"run\.json is no record of a training run .*train again"):
        learn(job(tmp_path, resume=True))


def test_another_recipe_is_not_mixed_in(tmp_path: Path) -> None:
    learn(job(tmp_path))
    with pytest.raises(CommandError, match=r"another recipe \(other: learning_rate\)"):
        learn(job(tmp_path, replace(RECIPE, learning_rate=1e-3)))


def test_a_full_disk_keeps_the_last_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learn(job(tmp_path))
    before = (tmp_path / "checkpoint.zip").read_bytes()

    def full(*args: Any, **kwargs: Any) -> None:
        raise OSError(28, "No space left on device")

    longer = replace(RECIPE, total_steps=256)
    run = json.loads((tmp_path / "run.json").read_text())
    run |= {"status": "interrupted", "recipe": {**run["recipe"], "total_steps": 256}}
    (tmp_path / "run.json").write_text(json.dumps(run))
    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="No space"):
        learn(job(tmp_path, longer, resume=True))
    assert (tmp_path / "checkpoint.zip").read_bytes() == before
    assert {path.name for path in tmp_path.glob(".*")} == {".lock", ".policy.json.lock"}  # no drafts


@pytest.mark.slow
def test_seeds_train_side_by_side(tmp_path: Path) -> None:
    jobs = [job(tmp_path / str(seed), seed=seed) for seed in range(2)]
    assert [found["seed"] for found in train_all(jobs, 2, "tiny")] == [0, 1]


def test_command(tmp_path: Path) -> None:
    train = partial(run, "train")
    small = ("--knob", "num_envs=4", "--knob", "steps_per_update=20", "--knob", "batch_size=64")
    few = ("--knob", "evaluations=1", "--knob", "evaluation_episodes=2", "--knob", "search_steps=0")
    base = ("FdiAttack-v0", "--steps", "80", "--seeds", "1", "--jobs", "1", "--out", str(tmp_path), *small, *few)
    code, printed, _ = train(*base, "--json")
    assert code == 0
    folder = Path(json.loads(printed)["runs"][0]["folder"])
    assert (folder / "policy.safetensors").is_file()
    code, printed, _ = train(*base)
    assert code == 0
    assert "best validation" in printed
    code, _, told = train(*base, "--knob", "discount=0.5")
    assert code == 2
    assert "another recipe" in told
    code, _, told = train("NoSuchEnv-v0")
    assert code == 2
    assert "no recipe and no environment" in told
    code, printed, _ = train("--list", "--json")
    assert code == 0
    assert "fdi" in {recipe["problem"] for recipe in json.loads(printed)}


def test_a_knob_that_was_added_later_makes_no_other_recipe(tmp_path: Path) -> None:
    learn(job(tmp_path))
    run = json.loads((tmp_path / "run.json").read_text())
    del run["recipe"]["gae_lambda"]
    (tmp_path / "run.json").write_text(json.dumps(run))
    assert learn(job(tmp_path))["status"] == "finished"
    with pytest.raises(CommandError, match="other: gae_lambda"):
        learn(job(tmp_path, replace(RECIPE, gae_lambda=0.5)))


@pytest.mark.parametrize("error", [Ended(signal.SIGTERM), MemoryError()])
def test_a_run_that_ends_before_it_learns_is_not_running(
    tmp_path: Path, error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    def end(*arguments: Any) -> None:
        raise error

    monkeypatch.setattr("cps_agents.learning.training.make_model", end)
    with pytest.raises(type(error)):
        learn(job(tmp_path))
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
    monkeypatch.undo()
    assert learn(job(tmp_path))["status"] == "finished"  # nothing is lost, so nobody has to ask for --resume
