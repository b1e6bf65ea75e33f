"""RLlib on the PettingZoo view; ray pins an older Gymnasium, so this runs where `cps-envs[rllib]` is installed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

ray = pytest.importorskip("ray")
pytest.importorskip("ray.rllib")
sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))


@pytest.fixture(autouse=True)
def _cluster() -> object:
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False, ignore_reinit_error=True)
    yield
    ray.shutdown()


def test_both_roles_learn() -> None:
    from rllib_ppo import configure

    algorithm = configure("rogue", 0, 64, preset="learning", duration_s=1.0).build_algo()
    returns = algorithm.train()["env_runners"]["agent_episode_returns_mean"]
    algorithm.stop()
    assert set(returns) == {"attacker_0", "defender_0"}
    assert np.isfinite(list(returns.values())).all()
    assert returns["attacker_0"] == pytest.approx(-returns["defender_0"])


def test_work_is_spread(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    from ray_cluster import play_everywhere, spread

    assert sorted(spread(lambda number: number**2, [-1, 2])) == [(-1, 1), (2, 4)]
    play_everywhere("rogue", 1, tmp_path)
    assert list((tmp_path / "cells").glob("*.json"))
