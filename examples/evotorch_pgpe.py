"""PGPE of EvoTorch, an evolution strategy: a linear policy for a role.

pip install cps-envs evotorch
python examples/evotorch_pgpe.py --role FdiAttack --cpu-seconds 60
"""

import time

import gymnasium
import torch
from evotorch.algorithms import PGPE
from evotorch.neuroevolution import GymNE
from judge import run


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    torch.set_num_threads(1)
    problem = GymNE(
        lambda: gymnasium.make(f"cps_envs:cps_envs/{role}-v0"), "Linear(obs_length, act_length)", num_episodes=2
    )
    rates = {"center_learning_rate": 0.1, "stdev_learning_rate": 0.1, "stdev_init": 0.1}
    searcher = PGPE(problem, popsize=64, optimizer="clipup", optimizer_config={"max_speed": 0.2}, **rates)
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        searcher.step()
    network = problem.to_policy(searcher.status["center"])
    return lambda rows: network(torch.as_tensor(rows)).argmax(1).numpy()


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack")
