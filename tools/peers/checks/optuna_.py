"""An Optuna study over a knob of PPO."""

from __future__ import annotations

import gymnasium
import optuna
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from trying import attempt


def study() -> None:
    def worth(trial: optuna.Trial) -> float:
        env = gymnasium.make("cps_envs:cps_envs/RogueAttack-v0", duration_s=3.0)
        rate = trial.suggest_float("learning_rate", 1e-4, 1e-2, log=True)
        model = PPO("MlpPolicy", env, learning_rate=rate, n_steps=32, batch_size=32).learn(32)
        return float(evaluate_policy(model, env, n_eval_episodes=1, warn=False)[0])

    assert optuna.create_study(direction="maximize").optimize(worth, n_trials=2) is None


if __name__ == "__main__":
    attempt("a study of two trials", study)
