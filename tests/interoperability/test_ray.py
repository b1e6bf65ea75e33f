"""Work spread by Ray, where `cps-envs[ray]` is installed."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

ray = pytest.importorskip("ray")
sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))


@pytest.fixture(autouse=True)
def _cluster() -> object:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, ignore_reinit_error=True)
    yield
    ray.shutdown()


def test_work_is_spread(tmp_path: Path) -> None:
    from ray_cluster import play_everywhere, spread

    assert sorted(spread(lambda number: number**2, [-1, 2])) == [(-1, 1), (2, 4)]
    play_everywhere("rogue", 1, tmp_path)
    assert list(tmp_path.glob("*.json"))


SHORT: dict[str, Any] = {
    "name": "tiny",
    "problem": "rogue",
    "preset": "easy",
    "overrides": {"duration_s": 3.0},
    "evaluation_episodes": 2,
}


def test_a_policy_search_is_spread_over_two_workers(tmp_path: Path) -> None:
    pytest.importorskip("cma")
    from cps_agents.learning.recipe import Recipe, changed

    knobs: dict[str, Any] = {
        "algorithm": "cma-es",
        "family": "rogue-switching",
        "population": 4,
        "scenes": [{"episodes": 2}],
        "total_timesteps": 16,
    }
    check_same_anywhere(changed(Recipe(), {**SHORT, **knobs}), tmp_path)


def test_our_own_ppo_is_spread_over_two_workers(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from cps_agents.learning.recipe import Recipe, changed

    small: dict[str, Any] = {"total_timesteps": 120, "num_envs": 4, "hidden": (4, 4), "evaluations": 1}
    check_same_anywhere(changed(Recipe(), {**SHORT, **small}), tmp_path)


def check_same_anywhere(recipe: Any, folder: Path) -> None:
    """That two seeds end, and that a worker's policy is the one that this process would have learned."""
    from ray_cluster import train_everywhere

    from cps_agents.learning.learner import learn
    from cps_agents.learning.run import TrainingJob

    train_everywhere(recipe, 2, folder)
    for seed in (0, 1):
        run = json.loads((folder / "tiny" / f"seed-{seed}" / "run.json").read_text())
        assert (run["status"], run["seed"]) == ("finished", seed)
    learn(TrainingJob(recipe, 1, folder / "here", "test"))
    assert (folder / "here" / "policy.safetensors").read_bytes() == (
        folder / "tiny" / "seed-1" / "policy.safetensors"
    ).read_bytes()
