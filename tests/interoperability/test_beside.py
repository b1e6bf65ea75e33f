"""Packages in the same environment: a study of Optuna, and a top-level name that was once ours."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import distributions
from typing import Any

import gymnasium
import pytest


@pytest.mark.slow
def test_optuna() -> None:
    """a study of two trials"""
    optuna, sb3 = pytest.importorskip("optuna"), pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.evaluation import evaluate_policy

    def worth(trial: Any) -> float:
        env = gymnasium.make("cps_envs:cps_envs/RogueAttack-v0", duration_s=3.0)
        rate = trial.suggest_float("learning_rate", 1e-4, 1e-2, log=True)
        model = sb3.PPO("MlpPolicy", env, learning_rate=rate, n_steps=32, batch_size=32).learn(32)
        return float(evaluate_policy(model, env, n_eval_episodes=1, warn=False)[0])

    optuna.create_study(direction="maximize").optimize(worth, n_trials=2)


@pytest.mark.skipif("openai-agents" not in {each.name for each in distributions()}, reason="needs openai-agents")
def test_openai_agents() -> None:
    """`import agents`, and `cps-envs --version`"""
    for code in ("import agents; agents.Agent", "from cps_agents.command import main; main()"):
        done = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-300:]
