"""`cleanrl_ppo.py`, judged as the other programs are: PyTorch and `gymnasium.make_vec`, no library of learners.

pip install cps-envs torch
python examples/plain_ppo.py --role FdiAttack --cpu-seconds 60
"""

import cleanrl_ppo
import numpy as np
import torch
from judge import run


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    envs, actor = cleanrl_ppo.train(role, cpu_seconds, seed=0)
    space = envs.single_action_space
    choices = np.ravel(getattr(space, "nvec", getattr(space, "n", 0))).tolist()

    def act(rows):
        with torch.no_grad():
            parts = actor(torch.as_tensor(rows)).split(choices, 1)
        return torch.stack([torch.distributions.Categorical(logits=part).sample() for part in parts], 1).numpy()

    return act


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack", per_agent=True)
