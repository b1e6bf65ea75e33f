"""PPO in one file, as CleanRL writes it: `python examples/cleanrl_ppo.py --role RogueDefense --seed 1`."""

from __future__ import annotations

import argparse
import time
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import Tensor, nn
from torch.distributions import Categorical

from cps_agents import save_network

STEPS, EPOCHS, BATCH, RATE, GAMMA, LAMBDA, ENTROPY = 64, 8, 256, 1e-3, 0.99, 0.95, 0.003
FIRST_SEED = 2_000_000  # lower ones are for evaluation and validation


def network(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    """Two hidden layers of 64."""
    layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)]
    for layer in layers[::2]:
        nn.init.orthogonal_(layer.weight, gain if layer is layers[-1] else 2**0.5)
    return nn.Sequential(*layers)


def train(role: str, cpu_seconds: float, seed: int, num_envs: int = 64, **options: Any) -> tuple[Any, nn.Sequential]:
    """Train on a role with discrete actions; the environments and the policy's network."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    own = {"autoreset": "same_step", "per_agent": True, **options}  # each agent of a team is a row
    envs: Any = gymnasium.make_vec(f"cps_envs:cps_envs/{role}-v0", num_envs=num_envs, **own)
    count = envs.num_envs
    choices = np.ravel(getattr(envs.single_action_space, "nvec", getattr(envs.single_action_space, "n", 0))).tolist()
    size, steps = envs.single_observation_space.shape[0], min(STEPS, envs.decisions)
    actor, critic = network(size, sum(choices), 0.01), network(size, 1, 1.0)
    optimizer = torch.optim.Adam(parameters := [*actor.parameters(), *critic.parameters()], lr=RATE, eps=1e-5)

    def policy(rows: Tensor) -> list[Categorical]:
        return [Categorical(logits=part, validate_args=False) for part in actor(rows).split(choices, 1)]

    def log_prob(parts: list[Categorical], actions: Tensor) -> Tensor:
        return torch.stack([part.log_prob(own) for part, own in zip(parts, actions.unbind(1), strict=True)]).sum(0)

    row = torch.from_numpy(envs.reset(seed=FIRST_SEED + 100_000 * seed)[0])
    total, discounted, variance, finished = np.zeros(count), np.zeros(count), 1.0, []
    begun, said = time.process_time(), 0.0
    while (spent := time.process_time() - begun) < cpu_seconds:
        played: list[tuple[Tensor, ...]] = []
        for _ in range(steps):
            with torch.no_grad():
                parts = policy(row)
                action = torch.stack([part.sample() for part in parts], 1)
                chance = log_prob(parts, action)
            following, reward, terminated, truncated, _ = envs.step(action.numpy().reshape(envs.action_space.shape))
            done, total, discounted = terminated | truncated, total + reward, discounted * GAMMA + reward
            variance = 0.99 * variance + 0.01 * float(np.mean(discounted**2))
            scaled = torch.from_numpy(reward / np.sqrt(variance + 1e-8)).float()
            played.append((row, action, chance, scaled, torch.from_numpy(done)))
            finished += total[done].tolist()
            total[done], discounted[done] = 0.0, 0.0
            row = torch.from_numpy(following)
        rows, actions, chances, rewards, ended = (torch.stack(part) for part in zip(*played, strict=True))
        with torch.no_grad():
            values = critic(torch.cat([rows, row[None]]))[..., 0]
        advantages, ahead = torch.zeros_like(rewards), torch.zeros(count)
        for t in reversed(range(steps)):
            goes_on = GAMMA * ~ended[t]
            advantages[t] = ahead = rewards[t] + goes_on * (values[t + 1] + LAMBDA * ahead) - values[t]
        targets = (advantages + values[:-1]).flatten()
        rows, actions, chances, advantages = (part.flatten(0, 1) for part in (rows, actions, chances, advantages))
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        optimizer.param_groups[0]["lr"] = RATE * max(1 - spent / cpu_seconds, 0.05)
        for part in [part for _ in range(EPOCHS) for part in torch.randperm(len(rows)).split(BATCH)]:
            parts = policy(rows[part])
            ratio = (log_prob(parts, actions[part]) - chances[part]).exp()
            gain = torch.min(ratio * advantages[part], ratio.clamp(0.8, 1.2) * advantages[part]).mean()
            entropy = torch.stack([each.entropy() for each in parts]).sum(0).mean()
            loss = 0.5 * (critic(rows[part])[:, 0] - targets[part]).square().mean() - gain - ENTROPY * entropy
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(parameters, 0.5)
            optimizer.step()
        if spent >= said and finished:
            print(f"{spent:4.0f} CPU s, a row returns {np.mean(finished[-500:]):.3f}", flush=True)
            said += cpu_seconds / 10
    return envs, actor


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, usual in {"role": "FdiAttack", "cpu-seconds": 60.0, "seed": 0}.items():
        parser.add_argument(f"--{name}", type=type(usual), default=usual)
    args = parser.parse_args()
    print("kept as", save_network(f"runs/cleanrl/{args.role}", *train(args.role, args.cpu_seconds, args.seed)))
