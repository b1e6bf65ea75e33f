"""PPO of AgileRL, without its evolution.

pip install cps-envs agilerl peft
python examples/agilerl_ppo.py --role FdiAttack --cpu-seconds 60
"""

import time

import gymnasium
import torch
from agilerl.algorithms import PPO
from agilerl.rollouts import collect_rollouts
from judge import run


def correct(buffer):
    """Let advantages end where episodes end: agilerl 2.58.0 reads the ends one step late, and final pay is lost."""
    computed = buffer.compute_returns_and_advantages

    def compute(last_value, last_done):
        buffer.buffer["dones"] = buffer.buffer["dones"].roll(1, 0)
        computed(last_value, last_done)

    buffer.compute_returns_and_advantages = compute


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    torch.set_num_threads(1)
    envs = gymnasium.make_vec(f"cps_envs/{role}-v0", 64, autoreset="same_step")
    spaces = envs.single_observation_space, envs.single_action_space
    agent = PPO(*spaces, num_envs=64, batch_size=512, learn_step=2048, lr=1e-3, update_epochs=4)
    correct(agent.rollout_buffer)
    last = {}
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        found = collect_rollouts(agent, envs, **last)
        last = dict(zip(("last_obs", "last_done", "last_scores", "last_info"), found[1:], strict=True))
        agent.learn()
    return lambda rows: agent.get_action(rows)[0]


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack")
