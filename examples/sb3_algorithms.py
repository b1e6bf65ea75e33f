"""The algorithms of stable-baselines3 and sb3-contrib.

pip install "cps-envs[sb3]"
python examples/sb3_algorithms.py --algorithm RecurrentPPO --role FdiAttack --cpu-seconds 60
"""

import time

import gymnasium
import sb3_contrib
import stable_baselines3
import torch
from judge import run

from cps_agents.sb3 import as_sb3

PPO = {"n_steps": 32, "batch_size": 512, "n_epochs": 4, "learning_rate": 1e-3}
OFF = {"learning_rate": 1e-3, "batch_size": 256, "learning_starts": 5000, "train_freq": 1, "gradient_steps": 4}
OFF |= {"target_update_interval": 500, "exploration_fraction": 0.3, "exploration_final_eps": 0.02}
SETTINGS = {
    "PPO": PPO,
    "RecurrentPPO": {**PPO, "policy": "MlpLstmPolicy"},
    "MaskablePPO": PPO,
    "TRPO": {"n_steps": 32, "batch_size": 512},
    "DQN": OFF,
    "QRDQN": OFF,
}


def train(role, cpu_seconds, algorithm):
    """Train, and return how the network acts."""
    torch.set_num_threads(1)
    envs = as_sb3(gymnasium.make_vec(f"cps_envs/{role}-v0", 64, autoreset="same_step"))
    maker = getattr(stable_baselines3, algorithm, None) or getattr(sb3_contrib, algorithm)
    model = maker(**{"policy": "MlpPolicy", **SETTINGS[algorithm]}, env=envs)
    end = time.process_time() + cpu_seconds
    if cpu_seconds:
        model.learn(10**9, callback=lambda *_: time.process_time() < end)
    state = None  # of an LSTM

    def act(rows, action_masks):
        nonlocal state
        more = {"action_masks": action_masks} if algorithm == "MaskablePPO" else {}
        actions, state = model.predict(rows, state, deterministic="DQN" in algorithm, **more)
        return actions

    return act


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack", algorithms=tuple(SETTINGS))
