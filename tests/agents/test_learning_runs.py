"""Training runs as folders and as commands: the same again, ended, damaged, of another recipe, side by side."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch")

from cps_agents.errors import CommandError
from cps_agents.interruption import Ended
from cps_agents.learning.learner import learn, train_all
from cps_agents.zoo.files import load
from cps_envs.core.documents import DamagedFileError
from tests.agents.command_line import refusal, succeeded
from tests.agents.test_ppo import job as job_of

job = partial(job_of, total_timesteps=1_280)


def test_termination_is_an_interruption(tmp_path: Path) -> None:
    def terminate(steps: int, note: str) -> None:
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), terminate)
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
    load(tmp_path / "policy.json")


def test_what_is_finished_is_not_done_again_and_a_damaged_record_is_named(tmp_path: Path) -> None:
    found = learn(job(tmp_path))
    assert found["status"] == "finished"
    assert learn(job(tmp_path, resume=True)) == found
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(DamagedFileError, match=r"run\.json is no record of a training run .*train again"):
        learn(job(tmp_path, resume=True))


def test_another_recipe_is_not_mixed_in(tmp_path: Path) -> None:
    learn(job(tmp_path))
    with pytest.raises(CommandError, match=r"another recipe \(other: learning_rate\)"):
        learn(job(tmp_path, learning_rate=3e-3))


def test_a_knob_that_was_added_later_makes_no_other_recipe(tmp_path: Path) -> None:
    learn(job(tmp_path))
    record = json.loads((tmp_path / "run.json").read_text())
    del record["recipe"]["gae_lambda"]
    (tmp_path / "run.json").write_text(json.dumps(record))
    assert learn(job(tmp_path))["status"] == "finished"
    with pytest.raises(CommandError, match="other: gae_lambda"):
        learn(job(tmp_path, gae_lambda=0.5))


def test_a_full_disk_keeps_the_last_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(steps: int, note: str) -> None:
        if (tmp_path / "checkpoint.safetensors").is_file():
            raise KeyboardInterrupt

    def full(*args: Any, **kwargs: Any) -> None:
        raise OSError(28, "No space left on device")

    longer = partial(job_of, tmp_path, total_timesteps=12_800)
    with pytest.raises(KeyboardInterrupt):
        learn(longer(), interrupt)
    before = (tmp_path / "checkpoint.safetensors").read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr("os.replace", full)
        with pytest.raises(OSError, match="No space"):
            learn(longer(resume=True))
    assert (tmp_path / "checkpoint.safetensors").read_bytes() == before
    assert {path.name for path in tmp_path.glob(".*")} <= {".lock", ".policy.json.lock"}  # no drafts


@pytest.mark.parametrize("error", [Ended(signal.SIGTERM), MemoryError()])
def test_a_run_that_ends_before_it_learns_is_not_running(
    tmp_path: Path, error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    def end(*arguments: Any) -> None:
        raise error

    with monkeypatch.context() as patched:
        patched.setattr("cps_agents.learning.shared.Keeper.begin", end)
        with pytest.raises(type(error)):
            learn(job(tmp_path))
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
    assert learn(job(tmp_path))["status"] == "finished"  # nothing is lost, so nobody has to ask for --resume


@pytest.mark.slow
def test_seeds_train_side_by_side(tmp_path: Path) -> None:
    jobs = [replace(job(tmp_path / str(seed)), seed=seed) for seed in range(2)]
    assert [found["seed"] for found in train_all(jobs, 2, "tiny")] == [0, 1]


def test_command(tmp_path: Path) -> None:
    train, refused = partial(succeeded, "train"), partial(refusal, "train")
    small = ("--knob", "num_envs=4", "--knob", "n_steps=20", "--knob", "batch_size=64")
    few = ("--knob", "evaluations=1", "--knob", "evaluation_episodes=2")
    base = ("FdiAttack-v0", "--steps", "80", "--seeds", "1", "--jobs", "1", "--out", str(tmp_path), *small, *few)
    folder = Path(json.loads(train(*base, "--json").stdout)["runs"][0]["folder"])
    assert (folder / "policy.safetensors").is_file()
    assert list((folder / "tensorboard").rglob("events*"))
    assert "best validation" in train(*base).stdout
    assert "another recipe" in refused(*base, "--knob", "gamma=0.5")
    easy = ("RogueAttack-v0", "--preset", "easy", "--name", "other", "--steps", "80", "--seeds", "1", "--jobs", "1")
    (run,) = json.loads(train(*easy, "--out", str(tmp_path), *small, *few, "--json").stdout)["runs"]
    settings = json.loads((Path(run["folder"]) / "run.json").read_text())["recipe"]
    assert (settings["preset"], settings["opponent"]) == ("easy", "")  # whom the preset's attackers meet
    assert "no recipe and no environment" in refused("NoSuchEnv-v0")
    assert "fdi" in {recipe["problem"] for recipe in json.loads(train("--list", "--json").stdout)}
