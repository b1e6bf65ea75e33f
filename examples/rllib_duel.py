"""Attacker and defender learn against each other: two policies of one PPO of RLlib, on PettingZoo's interface.

pip install cps-envs "ray[rllib]" torch
python examples/rllib_duel.py --role FdiAttack --cpu-seconds 60   # which of the two is judged, in its usual episodes
"""

import time
from importlib import import_module

import torch
from judge import run
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env


def train(role, cpu_seconds):
    """Train both, and return how the role's network acts."""
    name, side = role.split("A")[0].split("D")[0].lower(), "attacker" if role.endswith("Attack") else "defender"
    game = import_module(f"cps_envs.{name}_v0")
    register_env("duel", lambda _: ParallelPettingZooEnv(game.parallel_env(flat=True)))
    config = PPOConfig().environment("duel").env_runners(num_env_runners=0, num_envs_per_env_runner=8)
    config.multi_agent(policies={"attacker", "defender"}, policy_mapping_fn=lambda agent, _: agent.split("_")[0])
    config.training(train_batch_size_per_learner=2048, minibatch_size=1024, num_epochs=4, lr=1e-3)
    algorithm = config.build_algo()
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        algorithm.train()
    module = algorithm.get_module(side)

    def act(rows):
        with torch.no_grad():
            logits = module.forward_inference({"obs": torch.as_tensor(rows)})["action_dist_inputs"]
        return torch.distributions.Categorical(logits=logits).sample().numpy()

    return act


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack", per_agent=True, flat=True)
