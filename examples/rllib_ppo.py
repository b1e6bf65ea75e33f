"""PPO of RLlib's new stack, on a role by its id.

pip install cps-envs "ray[rllib]" torch
python examples/rllib_ppo.py --role FdiAttack --cpu-seconds 60
"""

import time

import torch
from judge import run
from ray.rllib.algorithms.ppo import PPOConfig


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    config = (
        PPOConfig()
        .environment(f"cps_envs:cps_envs/{role}-v0")
        .env_runners(num_env_runners=0, num_envs_per_env_runner=64, gym_env_vectorize_mode="vector_entry_point")
        .training(train_batch_size_per_learner=4096, minibatch_size=1024, num_epochs=4, lr=1e-3)
    )
    algorithm = config.build_algo()
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        algorithm.train()
    module = algorithm.get_module()

    def act(rows):
        with torch.no_grad():
            logits = module.forward_inference({"obs": torch.as_tensor(rows)})["action_dist_inputs"]
        return module.get_inference_action_dist_cls().from_logits(logits).sample().numpy()

    return act


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack")
