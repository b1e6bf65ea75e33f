"""PPO in one file, as CleanRL writes it, for any role: one agent or a team, discrete or continuous actions.

    python examples/cleanrl_ppo.py                                                  # FdiAttack against `cusum`
    python examples/cleanrl_ppo.py --role RogueDefense --cpu-seconds 60 --baseline monitor

It needs nothing of this package but `cps_envs.learning_env`, whose rows any single-agent library can learn from. The
network starts near the neutral action and keeps a discrete action for a while. That takes four lines of `Agent`.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import deque
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.distributions import Categorical, Normal

import cps_envs
from cps_agents import save_network
from cps_envs import LearningVectorEnv, WiredBox, play_episodes

PPO = {"n_steps": 64, "batch_size": 4096, "n_epochs": 4, "learning_rate": 1e-3, "gamma": 0.99, "gae_lambda": 0.95}


REPORTS = 10  # lines that a run prints


@dataclass
class Args:
    """What can be set; the role's own settings are in `envs.training`."""

    role: str = "FdiAttack"
    opponent: str = "cusum"  # "": the usual one of preset `learning`
    cpu_seconds: float = 40.0  # of training
    num_envs: int = 0  # 0: as many episodes side by side as the role's settings say
    seed: int = 0  # of the run; its episodes are never those of an evaluation
    out: str = "runs/cleanrl"
    baseline: str = "tracker"  # to compare with
    episodes: int = 100  # to compare on


def network(inputs: int, hidden: list[int], outputs: int, gain: float) -> nn.Sequential:
    """Dense layers with orthogonal weights and tanh between them."""
    sizes = [inputs, *hidden, outputs]
    layers: list[nn.Module] = []
    for place, (before, after) in enumerate(pairwise(sizes)):
        layer = nn.Linear(before, after)
        nn.init.orthogonal_(layer.weight, gain if place == len(hidden) else math.sqrt(2))
        nn.init.zeros_(layer.bias)
        layers += [layer, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


class Agent(nn.Module):
    """Policy and value function of rows that hold the inputs, then the last action, then what is legal."""

    def __init__(self, space: WiredBox, hidden: list[int]) -> None:
        super().__init__()
        columns, start = space.columns, space.untrained
        self.choices, self.stickiness, self.mask = list(start.choices), start.stickiness, columns.mask
        self.last = slice(columns.scaled, columns.scaled + columns.last_action)
        self.actor = network(columns.size, hidden, columns.last_action, gain=0.0)
        self.critic = network(columns.size, hidden, 1, gain=1.0)
        self.log_deviation = nn.Parameter(torch.full((columns.last_action,), math.log(start.deviation)))
        with torch.no_grad():  # the first actions are near the neutral one
            self.actor[-1].bias.copy_(torch.as_tensor(start.bias if self.choices else start.neutral))

    def distributions(self, rows: Tensor) -> list[Categorical] | list[Normal]:
        """Of each entry of a discrete action, or of all of a continuous one."""
        outputs = self.actor(rows)
        if not self.choices:
            return [Normal(outputs, self.log_deviation.exp(), validate_args=False)]
        logits = outputs + self.stickiness * rows[:, self.last]  # an action lasts for a while
        if self.mask:
            logits = logits.masked_fill(rows[:, -self.mask :] <= 0, -1e9)
        return [Categorical(logits=part, validate_args=False) for part in logits.split(self.choices, 1)]

    def draw(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (n, entries) and the logarithms of their probabilities (n,)."""
        parts = self.distributions(rows)
        action = torch.stack([part.sample() for part in parts], 1) if self.choices else parts[0].sample()
        return action, self.judge(parts, action)

    def judge(self, parts: list[Categorical] | list[Normal], actions: Tensor) -> Tensor:
        """The logarithms of the probabilities of actions (n, entries)."""
        if not self.choices:
            return parts[0].log_prob(actions).sum(1)
        return torch.stack([part.log_prob(own) for part, own in zip(parts, actions.unbind(1), strict=True)]).sum(0)


def train(args: Args) -> tuple[LearningVectorEnv, str, list[float]]:
    """Train and save; the environments, the saved policy's name, and the mean returns that it printed."""
    torch.manual_seed(args.seed)
    torch.set_num_threads(1)
    envs = cps_envs.learning_env(args.role, args.num_envs or None, opponent=args.opponent or None, seed=args.seed)
    ppo = {**PPO, **envs.training.ppo}
    gamma, ent_coef, shape = ppo["gamma"], ppo.get("ent_coef", 0.0), envs.action_space.shape
    agent = Agent(envs.single_observation_space, ppo.get("policy_kwargs", {}).get("net_arch", [64, 64]))
    optimizer = torch.optim.Adam(agent.parameters(), lr=ppo["learning_rate"], eps=1e-5, fused=True)
    row = torch.from_numpy(envs.reset()[0])
    discounted, square, count = np.zeros(envs.num_envs), 0.0, 0  # by whose size rewards are divided
    recent: deque[float] = deque(maxlen=200)  # returns of the last episodes
    history: list[float] = []
    began, due_s, updates, share = time.process_time(), 0.0, 0, 0.0

    while share < 1:
        rows, actions, log_probs, rewards, ended, active = [], [], [], [], [], []
        for _ in range(ppo["n_steps"]):
            with torch.inference_mode():
                action, log_prob = agent.draw(row)
            rows, actions, log_probs = [*rows, row], [*actions, action], [*log_probs, log_prob]
            active.append(torch.from_numpy(envs.active()))  # rows whose action has an effect now
            following, reward, done, _, info = envs.step(action.numpy().reshape(shape))
            row = torch.from_numpy(following)
            discounted = gamma * discounted + reward
            count += 1
            square += (np.mean(discounted**2) - square) / count
            discounted[done] = 0.0
            rewards.append(torch.as_tensor(reward, dtype=torch.float32))
            ended.append(torch.from_numpy(done))
            if done.any():
                recent.extend(info["final_info"]["episode"]["r"][done][:: envs.agents].tolist())

        batch = torch.stack(rows)
        with torch.no_grad():
            values = agent.critic(torch.cat([batch, row[None]]))[..., 0]
        advantages, ahead = torch.zeros_like(values[:-1]), 0.0
        for t in reversed(range(len(rewards))):  # an episode's end is the end of what is paid: nothing is bootstrapped
            goes_on = gamma * ~ended[t]
            error = rewards[t] / math.sqrt(square + 1e-8) + goes_on * values[t + 1] - values[t]
            advantages[t] = ahead = error + ppo["gae_lambda"] * goes_on * ahead
        targets = advantages + values[:-1]

        acted = torch.stack(active).flatten().nonzero()[:, 0]
        batch, actions, log_probs, advantages, targets = (
            part.flatten(0, 1)[acted]
            for part in (batch, torch.stack(actions), torch.stack(log_probs), advantages, targets)
        )
        advantages = ((advantages - advantages.mean()) / (advantages.std() + 1e-8)).clamp(-4, 4)
        optimizer.param_groups[0]["lr"] = ppo["learning_rate"] * (1 - 0.9 * share)
        for _ in range(ppo["n_epochs"]):
            for part in torch.randperm(len(batch)).split(ppo["batch_size"]):
                found = agent.distributions(batch[part])
                ratio = (agent.judge(found, actions[part]) - log_probs[part]).exp()
                gain = torch.min(ratio * advantages[part], ratio.clamp(0.8, 1.2) * advantages[part]).mean()
                bonus = ent_coef * sum(each.entropy().mean() for each in found)
                loss = 0.5 * (agent.critic(batch[part])[:, 0] - targets[part]).square().mean() - gain - bonus
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()

        updates += 1
        cpu_s = time.process_time() - began
        steps = updates * ppo["n_steps"] * envs.episodes * envs.training.frame_skip  # of the game
        share = cpu_s / args.cpu_seconds
        if recent and cpu_s >= due_s:
            history.append(float(np.mean(recent)))
            print(f"{cpu_s:6.1f} CPU s, return {history[-1]:8.3f}, {steps / cpu_s:,.0f} steps/CPU s", flush=True)
            due_s += args.cpu_seconds / REPORTS

    layers = [(each.weight.detach(), each.bias.detach()) for each in agent.actor if isinstance(each, nn.Linear)]
    deviation = None if agent.choices else agent.log_deviation.detach()
    facts = {"steps": steps, "cpu_s": cpu_s}
    kinds = {"log_deviation": deviation, "stickiness": agent.stickiness, "facts": facts}
    return envs, save_network(f"{args.out}/{args.role}", envs, layers, **kinds), history


def judge(args: Args, envs: LearningVectorEnv, learned: str) -> dict[str, float]:
    """Print what is paid to the attacker on seeds that training never saw, with differences on the same episodes."""
    other = "defender" if envs.role == "attacker" else "attacker"
    names = [learned, "none", args.baseline]
    pairs = {name: {envs.role: name, other: envs.opponent} for name in names}
    paid = {
        name: play_episodes(envs.problem, envs.config, pair, range(args.episodes))["return"]
        for name, pair in pairs.items()
    }
    print(f"against {envs.opponent}, {args.episodes} episodes, paid to the attacker:")
    for name in names:
        gap = paid[learned] - paid[name]
        error = 1.96 * gap.std(ddof=1) / math.sqrt(len(gap))
        beside = "" if name == learned else f"   learned minus this: {gap.mean():+.3f} +- {error:.3f}"
        print(f"  {name:30} {paid[name].mean():8.3f}{beside}")
    return {name: float(each.mean()) for name, each in paid.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for each in fields(Args):
        parser.add_argument(f"--{each.name.replace('_', '-')}", type=type(each.default), default=each.default)
    chosen = Args(**vars(parser.parse_args()))
    environments, name, _ = train(chosen)
    judge(chosen, environments, name)
