"""RLlib's PPO for both roles at once, on the PettingZoo view of a problem.

pip install "cps-envs[rllib]"          # ray brings a Gymnasium of its own: use a virtual environment of its own
python examples/rllib_ppo.py --problem rogue --iterations 10
ray job submit -- python examples/rllib_ppo.py --runners 32   # on a cluster
"""

from __future__ import annotations

import argparse
from importlib import import_module
from typing import Any

from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env


def make_env(config: dict[str, Any]) -> ParallelPettingZooEnv:
    """Attacker and defender in one environment."""
    options = dict(config)
    module = import_module(f"cps_envs.{options.pop('problem')}_v0")
    return ParallelPettingZooEnv(module.parallel_env(**options))


def configure(problem: str, runners: int, batch: int, **options: Any) -> PPOConfig:
    """One policy for each role, trained against each other."""
    register_env("cps_envs_duel", make_env)
    roles = ("attacker_0", "defender_0")
    return (
        PPOConfig()
        .environment("cps_envs_duel", env_config={"problem": problem, **options})
        .env_runners(num_env_runners=runners)
        .multi_agent(policies=set(roles), policy_mapping_fn=lambda agent, episode, **_: agent)
        .training(train_batch_size_per_learner=batch, minibatch_size=max(batch // 4, 1), num_epochs=4, gamma=0.995)
    )


def main() -> None:
    """Train and print what each role earns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problem", default="rogue")
    parser.add_argument("--iterations", type=int, default=10)
    parser.add_argument("--runners", type=int, default=0, help="processes that play; 0: this one")
    parser.add_argument("--batch", type=int, default=8192, help="decisions between two updates")
    args = parser.parse_args()
    algorithm = configure(args.problem, args.runners, args.batch, preset="learning").build_algo()
    for iteration in range(args.iterations):
        returns = algorithm.train()["env_runners"].get("agent_episode_returns_mean", {})
        print(iteration, {agent: round(float(value), 3) for agent, value in returns.items()})
    algorithm.stop()


if __name__ == "__main__":
    main()
