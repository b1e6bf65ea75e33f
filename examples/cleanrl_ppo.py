"""PPO in one file, as CleanRL writes it: `python examples/cleanrl_ppo.py --role RogueDefense --seed 1`."""

from __future__ import annotations

import argparse
import time
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import Tensor, nn

from cps_agents import save_network

STEPS, EPOCHS, BATCHES, RATE, GAMMA, LAMBDA, ENTROPY = 64, 5, 4, 1e-3, 0.99, 0.95, 0.003
MOST_KL, PART, FALLS = 0.01, 1 / 30, 0.3  # an update ends there; shares of the time: most of a rollout, rate falls
FIRST_SEED = 2_000_000  # lower ones are for evaluation and validation


def network(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    """Two hidden layers of 64."""
    layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)]
    for layer in layers[::2]:
        nn.init.orthogonal_(layer.weight, gain if layer is layers[-1] else 2**0.5)
    return nn.Sequential(*layers)


def train(role: str, cpu_seconds: float, seed: int, **options: Any) -> tuple[Any, nn.Sequential]:
    """Train on a role with discrete actions, with what its page recommends; each agent of a team is a row."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    alone: Any = gymnasium.make_vec(name := f"cps_envs:cps_envs/{role}-v0")
    page = alone.problem.training[alone.role]
    chosen = {"num_envs": page.num_envs, **page.practised, "autoreset": "same_step", "per_agent": True, **options}
    envs: Any = gymnasium.make_vec(name, **chosen)
    choices = np.ravel(getattr(envs.single_action_space, "nvec", getattr(envs.single_action_space, "n", 0))).tolist()
    size, steps = envs.single_observation_space.shape[0], min(STEPS, envs.decisions)
    actor, critic = network(size, sum(choices), 0.01), network(size, 1, 1.0)
    optimizer = torch.optim.Adam(parameters := [*actor.parameters(), *critic.parameters()], eps=1e-5)

    def policy(rows: Tensor) -> list[Tensor]:
        return [part.log_softmax(1) for part in actor(rows).split(choices, 1)]

    def log_prob(parts: list[Tensor], actions: Tensor) -> Tensor:
        return torch.cat([part.gather(1, actions[:, i : i + 1]) for i, part in enumerate(parts)], 1).sum(1)

    row = torch.from_numpy(envs.reset(seed=FIRST_SEED + 100_000 * seed)[0])
    begun, total, discounted, variance, finished = time.process_time(), *np.zeros((2, envs.num_envs)), 1.0, []
    while (spent := time.process_time() - begun) < cpu_seconds:
        played: list[tuple[Tensor, ...]] = []
        while len(played) < steps and time.process_time() - begun <= spent + PART * cpu_seconds:
            with torch.no_grad():
                parts = policy(row)
                action = torch.cat([part.exp().multinomial(1) for part in parts], 1)
                chance = log_prob(parts, action)
            following, reward, terminated, truncated, _ = envs.step(action.numpy().reshape(envs.action_space.shape))
            done, total, discounted = terminated | truncated, total + reward, discounted * GAMMA + reward
            variance = 0.99 * variance + 0.01 * float(np.mean(discounted**2))
            scaled = torch.from_numpy(reward / np.sqrt(variance + 1e-8)).float()
            played.append((row, action, chance, scaled, torch.from_numpy(done)))
            finished += total[done].tolist()
            total[done], discounted[done], row = 0.0, 0.0, torch.from_numpy(following)
        rows, actions, chances, rewards, ended = (torch.stack(part) for part in zip(*played, strict=True))
        with torch.no_grad():
            values = critic(torch.cat([rows, row[None]]))[..., 0]
        advantages, ahead = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
        for t in reversed(range(len(played))):
            advantages[t] = ahead = rewards[t] - values[t] + GAMMA * (values[t + 1] + LAMBDA * ahead) * ~ended[t]
        targets = (advantages + values[:-1]).flatten()
        rows, actions, chances, advantages = (part.flatten(0, 1) for part in (rows, actions, chances, advantages))
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        optimizer.param_groups[0]["lr"] = RATE * min((1 - spent / cpu_seconds) / FALLS, 1.0)
        for _ in range(EPOCHS):
            moved = []
            for part in torch.randperm(len(rows)).chunk(BATCHES):
                parts = policy(rows[part])
                change = log_prob(parts, actions[part]) - chances[part]
                ratio = change.exp()
                moved.append(float((ratio - 1 - change).mean().detach()))
                gain = torch.min(ratio * advantages[part], ratio.clamp(0.8, 1.2) * advantages[part]).mean()
                entropy = -torch.cat([each * each.exp() for each in parts], 1).sum(1).mean()
                missed = critic(rows[part])[:, 0] - targets[part]
                optimizer.zero_grad()
                (0.5 * missed.square().mean() - gain - ENTROPY * entropy).backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
            if np.mean(moved) > MOST_KL:
                break
        if finished:
            print(f"{spent:4.0f} CPU s, a row returns {np.mean(finished[-500:]):.3f}", flush=True)
    return envs, actor


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, usual in {"role": "FdiAttack", "cpu-seconds": 60.0, "seed": 0}.items():
        parser.add_argument(f"--{name}", type=type(usual), default=usual)
    args = parser.parse_args()
    print("kept as", save_network(f"runs/cleanrl/{args.role}", *train(args.role, args.cpu_seconds, args.seed)))
