"""PPO of Tianshou, on a role by its id.

pip install cps-envs tianshou
python examples/tianshou_ppo.py --role FdiAttack --cpu-seconds 60
"""

import time

import gymnasium
import torch
from judge import run
from tianshou.algorithm import PPO
from tianshou.algorithm.algorithm_base import policy_within_training_step
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Batch, Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.utils.net.common import Net
from tianshou.utils.net.discrete import DiscreteActor, DiscreteCritic


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    torch.set_num_threads(1)
    envs = DummyVectorEnv([lambda: gymnasium.make(f"cps_envs:cps_envs/{role}-v0") for _ in range(16)])
    shape, actions = envs.observation_space[0].shape, envs.action_space[0]
    body = [Net(state_shape=shape, hidden_sizes=[64, 64]) for _ in range(2)]
    policy = ProbabilisticActorPolicy(
        actor=DiscreteActor(preprocess_net=body[0], action_shape=actions.n, softmax_output=False),
        dist_fn=lambda logits: torch.distributions.Categorical(logits=logits),
        action_space=actions,
        action_scaling=False,
    )
    critic = DiscreteCritic(preprocess_net=body[1])
    algorithm = PPO(policy=policy, critic=critic, optim=AdamOptimizerFactory(lr=1e-3), gae_lambda=0.95)
    collector = Collector(algorithm, envs, VectorReplayBuffer(4096, len(envs)))
    collector.reset()
    end = time.process_time() + cpu_seconds
    with policy_within_training_step(policy):
        while time.process_time() < end:
            collector.collect(n_step=1280)
            algorithm.update(collector.buffer, 256, 4)
            collector.reset_buffer()
    return lambda rows: policy(Batch(obs=rows, info={})).act.numpy()


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack")
