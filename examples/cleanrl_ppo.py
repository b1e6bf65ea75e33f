"""PPO in one file, as CleanRL writes it, on a native vector environment.

    python examples/cleanrl_ppo.py --env-id cps_envs/RogueAttack-v0 --total-steps 200000

Everything that a run does stands below, from top to bottom; `cps-envs train` has checkpoints, evaluation and recipes.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, fields
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn
from torch.distributions import Normal

import cps_envs  # noqa: F401  registers the environments


@dataclass
class Args:
    """The knobs."""

    env_id: str = "cps_envs/RogueAttack-v0"  # any environment with continuous actions
    preset: str = "learning"
    total_steps: int = 500_000  # of all environments together
    num_envs: int = 64
    num_steps: int = 128  # between two updates, of each environment
    num_minibatches: int = 4
    update_epochs: int = 4
    learning_rate: float = 3e-4
    gamma: float = 0.995
    gae_lambda: float = 0.95
    clip: float = 0.2
    reward_scale: float = 0.1
    seed: int = 2_000_000  # far from the seeds that evaluations use


def layer(inputs: int, outputs: int, gain: float = float(np.sqrt(2))) -> nn.Linear:
    """A dense layer with orthogonal weights."""
    made = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(made.weight, gain)
    nn.init.zeros_(made.bias)
    return made


class Agent(nn.Module):
    """Policy and value, two layers each."""

    def __init__(self, inputs: int, actions: int) -> None:
        super().__init__()
        self.mean = nn.Sequential(layer(inputs, 64), nn.Tanh(), layer(64, 64), nn.Tanh(), layer(64, actions, gain=0.01))
        self.value = nn.Sequential(layer(inputs, 64), nn.Tanh(), layer(64, 64), nn.Tanh(), layer(64, 1, gain=1.0))
        self.log_deviation = nn.Parameter(torch.full((actions,), -0.7))

    def distribution(self, observation: torch.Tensor) -> Normal:
        """Of the actions."""
        return Normal(self.mean(observation), self.log_deviation.exp())


def advantages(rewards: torch.Tensor, values: torch.Tensor, ended: torch.Tensor, last: torch.Tensor, args: Args) -> Any:
    """Generalised advantage estimates (T, B); an episode's end is the end of what is paid."""
    result = torch.zeros_like(rewards)
    ahead = torch.zeros_like(last)
    for step in reversed(range(len(rewards))):
        going_on = 1.0 - ended[step]
        following = values[step + 1] if step + 1 < len(rewards) else last
        error = rewards[step] + args.gamma * following * going_on - values[step]
        ahead = error + args.gamma * args.gae_lambda * going_on * ahead
        result[step] = ahead
    return result


def train(args: Args) -> list[float]:
    """Train; returns the mean return of the episodes that ended in each update's steps."""
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    envs = gymnasium.make_vec(
        args.env_id, args.num_envs, "vector_entry_point", preset=args.preset, autoreset_mode=AutoresetMode.SAME_STEP
    )
    inputs, actions = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]  # type: ignore[index]
    agent = Agent(inputs, actions)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    observation = torch.as_tensor(envs.reset(seed=args.seed)[0])
    running = np.zeros(args.num_envs)
    history: list[float] = []
    started = time.monotonic()
    per_update = args.num_envs * args.num_steps

    for update in range(max(args.total_steps // per_update, 1)):
        rows: dict[str, list[torch.Tensor]] = {
            name: [] for name in ("seen", "acted", "likelihood", "paid", "ended", "value")
        }
        finished: list[float] = []
        for _ in range(args.num_steps):
            with torch.no_grad():
                distribution = agent.distribution(observation)
                action = distribution.sample()
                value = agent.value(observation)[:, 0]
            following, reward, terminated, truncated, _ = envs.step(action.numpy())
            ended = terminated | truncated
            running += reward
            finished += running[ended].tolist()
            running[ended] = 0.0
            for name, entry in (
                ("seen", observation),
                ("acted", action),
                ("likelihood", distribution.log_prob(action).sum(1)),
                ("paid", torch.as_tensor(args.reward_scale * reward, dtype=torch.float32)),
                ("ended", torch.as_tensor(ended, dtype=torch.float32)),
                ("value", value),
            ):
                rows[name].append(entry)
            observation = torch.as_tensor(following)
        batch = {name: torch.stack(entries) for name, entries in rows.items()}
        with torch.no_grad():
            last = agent.value(observation)[:, 0]
            advantage = advantages(batch["paid"], batch["value"], batch["ended"], last, args)
        target = (advantage + batch["value"]).flatten()
        flat = {name: entries.flatten(0, 1) for name, entries in batch.items()}
        advantage = advantage.flatten()

        for _ in range(args.update_epochs):
            for chosen in torch.randperm(per_update).chunk(args.num_minibatches):
                distribution = agent.distribution(flat["seen"][chosen])
                ratio = (distribution.log_prob(flat["acted"][chosen]).sum(1) - flat["likelihood"][chosen]).exp()
                weight = (advantage[chosen] - advantage[chosen].mean()) / (advantage[chosen].std() + 1e-8)
                clipped = ratio.clamp(1 - args.clip, 1 + args.clip)
                policy_loss = -torch.min(ratio * weight, clipped * weight).mean()
                value_loss = 0.5 * (agent.value(flat["seen"][chosen])[:, 0] - target[chosen]).square().mean()
                optimizer.zero_grad()
                torch.autograd.backward(policy_loss + value_loss)
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()

        if finished:
            history.append(float(np.mean(finished)))
            speed = (update + 1) * per_update / (time.monotonic() - started)
            print(f"{(update + 1) * per_update:>9} steps, return {history[-1]:8.2f}, {speed:,.0f} steps/s")
    envs.close()
    return history


def parse() -> Args:
    """The knobs from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for knob in fields(Args):
        parser.add_argument(f"--{knob.name.replace('_', '-')}", type=type(knob.default), default=knob.default)
    return Args(**vars(parser.parse_args()))


if __name__ == "__main__":
    train(parse())
