"""Checkpoints: how often they are written, what is in them, and that a run that was killed goes on exactly."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

from safetensors.numpy import load as from_bytes
from safetensors.numpy import save as to_bytes

from cps_agents.errors import CommandError
from cps_agents.learning.checkpoint import arrays_of, read_arrays, restore, write_checkpoint
from cps_agents.learning.learner import learn
from cps_agents.learning.ppo import LearningProgress
from cps_agents.learning.recipe import SHARED, Recipe, changed
from cps_agents.learning.shared import is_due, make_envs, make_learner
from cps_agents.recipes.finding import RECIPES
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import Array
from tests.agents.test_ppo import job, recipe_of
from tests.core.toy import TOY
from tests.turns import slow

ROOT = Path(__file__).parents[2]
OURS = [name for name, recipe in RECIPES.items() if recipe.algorithm == SHARED]
MOST_SHARE, MOST_S = 0.1, 60.0  # that a run which is killed may lose
FEW = 3_200  # steps
SLOWEST = 4_000  # steps per CPU second


def starts_at_once(recipe: Recipe) -> bool:
    """Whether all episodes start anew at each update."""
    return recipe.ppo.episode_noise or recipe.ppo.copies > 1


def envs_of(recipe: Recipe, **changes: Any) -> LearningVectorEnv:
    """The environments of a recipe, whose inputs are not scaled."""
    return make_envs(changed(recipe, changes), 0, scaling=((), ()))


@pytest.mark.parametrize("name", OURS)
def test_a_run_that_is_killed_loses_a_tenth_or_a_minute_at_the_most(name: str) -> None:
    recipe = RECIPES[name]
    envs = envs_of(recipe, num_envs=2 * recipe.ppo.copies)
    decisions = envs.decisions if starts_at_once(recipe) else recipe.ppo.n_steps
    steps = decisions * recipe.training.num_envs * envs.wired.wiring.frame_skip  # of an update
    share = steps / recipe.training.total_timesteps
    lost = next(share * count for count in range(1, 1000) if is_due(share * count, steps * count / SLOWEST))
    assert lost <= MOST_SHARE or lost * recipe.training.total_timesteps / SLOWEST <= MOST_S


LATE = [name for name in OURS if not starts_at_once(RECIPES[name])]
LONG = ("hvac-defense", "rogue-defense")  # take seconds


@pytest.mark.parametrize("name", [slow(name) if name in LONG else name for name in LATE])
def test_episodes_go_on_bit_for_bit_whoever_plays_them(name: str) -> None:
    recipe = changed(RECIPES[name], {"num_envs": 4})
    whole, again = envs_of(recipe), envs_of(recipe)
    whole.keep_past()
    whole.reset(options={"start": 3})
    draws = np.random.default_rng(0)
    for _ in range(min(whole.decisions, 30)):
        whole.step(random_actions(whole, draws))
    past = from_bytes(to_bytes(whole.past()))
    np.testing.assert_array_equal(whole._side.observe(), again.resume(past))
    for _ in range(min(whole.decisions, 10)):
        actions = random_actions(whole, draws)
        for one, other in zip(whole.step(actions), again.step(actions), strict=True):
            if isinstance(one, np.ndarray):
                np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(whole.privileged(), again.privileged())
    for name, array in whole.past().items():
        np.testing.assert_array_equal(array, again.past()[name])


def random_actions(envs: LearningVectorEnv, generator: np.random.Generator) -> Array:
    envs.action_space.seed(int(generator.integers(2**31)))
    return np.asarray(envs.action_space.sample())


def test_a_past_is_kept_where_episodes_start_at_once() -> None:
    with pytest.raises(ConfigurationError, match="same_step"):
        LearningVectorEnv(TOY, "attacker", 2, autoreset="next_step").keep_past()
    with pytest.raises(ConfigurationError, match="training"):
        LearningVectorEnv(TOY, "attacker", 2, evaluation=True).keep_past()


@pytest.mark.parametrize("noise", [False, True])
def test_a_resumed_run_is_the_same_bit_for_bit(noise: bool) -> None:
    recipe = recipe_of("defender" if noise else "attacker", episode_noise=noise, n_steps=7, total_timesteps=FEW)
    whole, kept = make_learner(recipe, 0), []

    def keep(progress: LearningProgress) -> None:
        if progress.share > 0.4 and not kept and (noise or whole.between_starts):
            kept.append(arrays_of(whole))

    whole.learn(keep)
    resumed = make_learner(recipe, 0, kept[0])
    restore(resumed, kept[0])
    assert 0 < resumed.share < 1
    assert {"past/actions", "discounted"} <= kept[0].keys() or noise
    resumed.learn()
    ends = arrays_of(whole), arrays_of(resumed)
    for name, array in ends[0].items():
        if name != "numbers":
            np.testing.assert_array_equal(array, ends[1][name])
    assert ends[0]["numbers"][1] == ends[1]["numbers"][1]


KILLED = """
import os, signal, sys
from pathlib import Path
from cps_agents.learning.learner import learn
from tests.agents.test_ppo import job

def kill(steps, note):
    if steps > int(sys.argv[2]) // 2:
        os.kill(os.getpid(), signal.SIGKILL)

learn(job(Path(sys.argv[1]), n_steps=7, total_timesteps=int(sys.argv[2])), kill)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="knows no SIGKILL")
def test_a_killed_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    folders = tmp_path / "killed", tmp_path / "whole"
    for place, folder in enumerate(folders):
        if place == 0:
            command = [sys.executable, "-c", KILLED, str(folder), str(FEW)]
            assert subprocess.run(command, cwd=ROOT, check=False).returncode == -9
            stopped = json.loads((folder / "run.json").read_text())
            assert (stopped["status"], 0.4 * FEW < stopped["steps"] < 0.6 * FEW) == ("running", True)
        learn(job(folder, n_steps=7, total_timesteps=FEW, resume=place == 0))
    kept = [read_arrays(folder / "checkpoint.safetensors") for folder in folders]
    for name, array in kept[0].items():
        if name != "numbers":
            np.testing.assert_array_equal(array, kept[1][name])
    assert (folders[0] / "policy.safetensors").read_bytes() == (folders[1] / "policy.safetensors").read_bytes()


def test_a_checkpoint_that_does_not_fit_is_refused() -> None:
    learner = make_learner(recipe_of("attacker", n_steps=7), 0)
    learner.start()
    learner.improve(1.0)
    learner.updates += 1
    arrays = arrays_of(learner)
    name = "network/policy.0.weight"
    for wrong in (arrays[name][:, :2], arrays[name].astype(np.float64), np.full_like(arrays[name], np.nan)):
        with pytest.raises(ValueError, match="not"):
            restore(learner, {**arrays, name: wrong})
    for missing in ("counts", "past/age", "past/actions", "past/lengths", "discounted", "returns/found"):
        with pytest.raises(ValueError, match=missing.removeprefix("past/")):
            restore(learner, {key: array for key, array in arrays.items() if key != missing})
    restore(learner, arrays)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("actions", lambda actions: actions + 1000, "action"),
        ("actions", lambda actions: actions[1:], "actions for"),
        ("actions", lambda actions: actions[:, 1:], "shape"),
        ("age", lambda age: age - 1000, "age"),
        ("age", lambda age: age.astype(np.int32), "int32"),
        ("streams", lambda streams: streams * np.uint64(0), "even"),
        ("spawned", lambda spawned: spawned - 5, "children"),
        ("spawned", lambda spawned: spawned + 2**40, "children"),
        ("start", lambda start: start - 5, "start"),
        ("start", lambda start: start.repeat(2), "size 1"),
        ("returns", lambda returns: returns * np.nan, "finite"),
        ("lengths", lambda lengths: lengths[1:], "shape"),
    ],
)
def test_a_past_that_cannot_be_is_refused(name: str, change: Any, message: str) -> None:
    envs = LearningVectorEnv(TOY, "attacker", 4)
    envs.keep_past()
    envs.reset()
    envs.step(np.ones(4, np.int64))
    past = envs.past()
    with pytest.raises(ValueError, match=message):
        envs.resume({**past, name: change(past[name])})


def test_no_episode_of_a_past_goes_on_after_its_end() -> None:
    envs = LearningVectorEnv(TOY, "attacker", 4)
    envs.keep_past()
    envs.reset()
    past = envs.past()
    beyond = envs.decisions + 1
    actions = np.ones((beyond, 4), np.int64)
    with pytest.raises(ValueError, match="end"):
        envs.resume({**past, "age": np.full(4, beyond), "actions": actions})
    with pytest.raises(ValueError, match="ended"):
        envs.resume({**past, "age": np.full(4, beyond - 1), "actions": actions[:-1]})


def test_a_damaged_checkpoint_is_named(tmp_path: Path) -> None:
    def interrupt(steps: int, note: str) -> None:
        if (tmp_path / "checkpoint.safetensors").is_file():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), interrupt)
    path = tmp_path / "checkpoint.safetensors"
    whole = path.read_bytes()
    for place in (5, 100, len(whole) - 1):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(CommandError, match=r"checkpoint\.safetensors is damaged .*train again"):
            learn(job(tmp_path, resume=True))
    path.write_bytes(whole[:100])
    with pytest.raises(CommandError, match=r"checkpoint\.safetensors is damaged"):
        learn(job(tmp_path, resume=True))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    learner = make_learner(recipe_of("attacker"), 0)
    write_checkpoint(tmp_path / "checkpoint.safetensors", learner)
    found = read_arrays(tmp_path / "checkpoint.safetensors")
    for name, array in arrays_of(learner).items():
        np.testing.assert_array_equal(array, found[name])
