"""Checkpoints: a run goes on from all that it had learned, and a file of a stranger runs no code."""

from __future__ import annotations

import base64
import json
import os
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import torch

from cps_agents.errors import CommandError
from cps_agents.learning import training
from cps_agents.learning.learner import learn
from cps_agents.learning.model import CLASSES
from cps_agents.learning.training import load_checkpoint
from cps_agents.learning.training_envs import make_envs
from tests.agents.test_learning_parts import CASES
from tests.agents.test_learning_runs import RECIPE, job


def rewritten(path: Path, change: Any) -> None:
    """Change the settings in a checkpoint."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    settings = json.loads(parts["data"])
    change(settings)
    parts["data"] = json.dumps(settings).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)


@pytest.mark.parametrize("case", ["ppo", "sac", "recurrent-ppo", "dqn"])
def test_a_run_goes_on_from_all_that_it_had_learned(case: str, tmp_path: Path) -> None:
    recipe = replace(CASES[case], total_steps=128, evaluations=1, evaluation_episodes=2, learning_starts=32)
    task = job(tmp_path, recipe)
    learn(task)
    envs = make_envs(recipe, 0)
    model: Any = load_checkpoint(task.run, envs, "cpu")
    usual: Any = CLASSES[recipe.algorithm].load(task.run.checkpoint, env=envs, device="cpu")
    for name, kept in usual.get_parameters().items():
        torch.testing.assert_close(model.get_parameters()[name], kept, rtol=0, atol=0)
    for name in ("num_timesteps", "_n_updates", "_n_calls"):
        assert getattr(model, name, None) == getattr(usual, name, None)
    if case == "sac":
        torch.testing.assert_close(model.log_ent_coef, usual.log_ent_coef)
    assert model.lr_schedule(0.3) == usual.lr_schedule(0.3)


class Trap:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self.path),)


def test_a_checkpoint_of_a_stranger_runs_no_code(tmp_path: Path) -> None:
    recipe = replace(RECIPE, total_steps=256)

    def interrupt(steps: int, note: str) -> None:
        if steps >= 128:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path, recipe), interrupt)
    trap = base64.b64encode(pickle.dumps(Trap(tmp_path / "caught"))).decode()

    def set_traps(settings: dict[str, Any]) -> None:
        for name in settings:
            if name != "num_timesteps":
                settings[name] = {":type:": "trap", ":serialized:": trap}

    rewritten(tmp_path / "checkpoint.zip", lambda settings: settings.update(policy_class={":serialized:": trap}))
    assert learn(job(tmp_path, recipe, resume=True))["steps"] == 256
    rewritten(tmp_path / "checkpoint.zip", set_traps)
    with pytest.raises(CommandError, match=r"checkpoint\.zip is damaged .*_n_updates is .*a whole number"):
        load_checkpoint(job(tmp_path, recipe).run, make_envs(recipe, 0), "cpu")
    assert not (tmp_path / "caught").exists()


@pytest.mark.parametrize("steps", [-1, "many", 1e30, None])
def test_steps_that_make_no_sense_are_refused(steps: Any, tmp_path: Path) -> None:
    learn(job(tmp_path))
    rewritten(tmp_path / "checkpoint.zip", lambda settings: settings.update(num_timesteps=steps))
    with pytest.raises(CommandError, match=r"checkpoint\.zip is damaged .*num_timesteps"):
        load_checkpoint(job(tmp_path).run, make_envs(RECIPE, 0), "cpu")


def test_a_checkpoint_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learn(job(tmp_path))
    monkeypatch.setattr(training, "MOST_BYTES", 1000)
    with pytest.raises(CommandError, match=r"more than 1000.*train again"):
        load_checkpoint(job(tmp_path).run, make_envs(RECIPE, 0), "cpu")


def test_a_checkpoint_of_another_network_is_refused(tmp_path: Path) -> None:
    learn(job(tmp_path))
    with pytest.raises(CommandError, match=r"checkpoint\.zip is damaged"):
        load_checkpoint(job(tmp_path, replace(RECIPE, hidden=(4,))).run, make_envs(RECIPE, 0), "cpu")
