"""Self-play with TorchRL: attacker and defender learn against each other, each by PPO, from reward alone.

    python examples/torchrl_self_play.py                               # the fdi duel, two CPU minutes
    python examples/torchrl_self_play.py --problem rogue --png rogue.png

In a zero-sum game the returns of self-play say little: both sides get better at once. So from time to time each side
also plays policies of the package that do not learn, on the evaluation seeds.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch import nn
from torch.distributions import Categorical, Independent
from torch.nn import functional
from torchrl.collectors import Collector
from torchrl.modules import ProbabilisticActor
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from cps_agents import save_network
from cps_agents.torchrl import DuelEnv
from cps_envs import find_problem, play_episodes, types

NEVER = -1e9  # logit of what is no choice
HORIZON = 20  # decisions over which rewards add up; chosen, of the order of what gamma and lambda look ahead


@dataclass
class Args:
    """What can be set."""

    problem: str = "fdi"  # one whose roles have discrete actions
    cpu_seconds: float = 120.0  # of training, judging left out
    num_envs: int = 256
    num_steps: int = 20  # decisions of each episode between two updates
    epochs: int = 4
    batch_size: int = 1280  # decisions of both sides
    learning_rate: float = 1e-3
    gamma: float = 0.99
    gae_lambda: float = 0.95
    judgements: int = 8  # rows of the table, the start left out
    episodes: int = 100  # of each judgement
    seed: int = 0
    out: str = "runs/torchrl"
    png: str = ""  # file for the curves


class Network(nn.Sequential):
    """Two hidden layers."""

    def __init__(self, inputs: int, outputs: int, gain: float) -> None:
        sizes, layers = [inputs, 64, 64, outputs], list[nn.Module]()
        for place, (before, after) in enumerate(pairwise(sizes)):
            layer = nn.Linear(before, after)
            nn.init.orthogonal_(layer.weight, gain if place == 2 else math.sqrt(2))
            nn.init.zeros_(layer.bias)
            layers += [layer, nn.Tanh()]
        super().__init__(*layers[:-1])


def distribution(choices: tuple[int, ...]) -> Any:
    """What draws actions from logits: a number, or one for each of the choices, which may be of different sizes."""
    if len(choices) == 1:
        return Categorical
    widest = max(choices)

    def joint(logits: Any) -> Independent:
        parts = torch.split(logits, list(choices), -1)
        padded = [functional.pad(part, (0, widest - part.shape[-1]), value=NEVER) for part in parts]
        return Independent(Categorical(logits=torch.stack(padded, -2)), 1)

    return joint


def learner(env: DuelEnv, role: types.Role, args: Args) -> ClipPPOLoss:
    """Policy and value function of a role, whose agents share them, and the loss of both."""
    agent = next(name for name, own in env.envs.roles.items() if own == role)
    choices = np.ravel(getattr(env.envs.action_space(agent), "nvec", getattr(env.envs.action_space(agent), "n", 0)))
    size = env.envs.observation_space(agent).shape[0]
    seen, logits, action, likelihood = (role, "observation"), (role, "logits"), (role, "action"), (role, "likelihood")
    actor = ProbabilisticActor(
        TensorDictModule(Network(size, int(choices.sum()), gain=0.01), [seen], [logits]),
        in_keys={"logits": logits},
        out_keys=[action],
        distribution_class=distribution(tuple(choices.tolist())),
        return_log_prob=True,
        log_prob_key=likelihood,
    )
    critic = TensorDictModule(Network(size, 1, gain=1.0), [seen], [(role, "state_value")])
    loss = ClipPPOLoss(
        actor, critic, entropy_coeff=0.003, critic_coeff=0.5, loss_critic_type="l2", normalize_advantage=True
    )
    names = ("reward", "action", "advantage", "value_target", "done", "terminated")
    loss.set_keys(sample_log_prob=likelihood, value=(role, "state_value"), **{name: (role, name) for name in names})
    loss.make_value_estimator(ValueEstimators.GAE, gamma=args.gamma, lmbda=args.gae_lambda)
    return loss


def prepare(data: TensorDictBase, losses: dict[types.Role, ClipPPOLoss], scale: dict[types.Role, float]) -> None:
    """Give each agent the end of its episode, divide rewards by the size they had first, and estimate advantages."""
    for role, loss in losses.items():
        reward = data["next", role, "reward"]
        scale.setdefault(role, max(float(reward.square().mean().sqrt()) * HORIZON**0.5, 1e-3))
        data["next", role, "reward"] = reward / scale[role]
        for name in ("done", "terminated"):
            data["next", role, name] = data["next", name].unsqueeze(-2).expand(reward.shape)
        with torch.no_grad():
            loss.value_estimator(
                data, params=loss.critic_network_params, target_params=loss.target_critic_network_params
            )


def judge(env: DuelEnv, losses: dict[types.Role, ClipPPOLoss], args: Args) -> dict[types.Role, float]:
    """What is paid to the attacker when each side plays a fixed opponent; kept in `args.out` along the way."""
    problem, paid = find_problem(args.problem), {}
    for role, other in zip(types.ROLES, reversed(types.ROLES), strict=True):
        agent = next(name for name, own in env.envs.roles.items() if own == role)
        network = losses[role].actor_network.module[0].module
        name = save_network(f"{args.out}/{args.problem}-{role}", env.envs, network, agent=agent)
        pair = {role: name, other: problem.opponent("learning", other)}
        found = play_episodes(problem, env.envs.config, pair, range(args.episodes))
        paid[role] = float(found["return"].mean())
    return paid


def train(args: Args) -> list[tuple[float, float, float]]:
    """Train both; for each judgement CPU seconds, and what the attacker gets with the learned attacker and defender."""
    torch.manual_seed(args.seed)
    torch.set_num_threads(1)
    env = DuelEnv(args.problem, args.num_envs, seed=args.seed)
    losses = {role: learner(env, role, args) for role in types.ROLES}
    optimizers = {
        role: torch.optim.Adam(loss.parameters(), args.learning_rate, eps=1e-5) for role, loss in losses.items()
    }
    policy = TensorDictSequential(*(loss.actor_network for loss in losses.values()))
    frames = args.num_envs * args.num_steps
    rows, scale = [(0.0, *judge(env, losses, args).values())], dict[types.Role, float]()
    report(args, rows[-1])
    cpu_s, began = 0.0, time.process_time()
    for data in Collector(env, policy, frames_per_batch=frames, total_frames=-1, auto_register_policy_transforms=False):
        prepare(data, losses, scale)
        flat = data.reshape(-1)
        for _ in range(args.epochs):
            for part in torch.randperm(frames).split(args.batch_size):
                for role, loss in losses.items():
                    found = loss(flat[part])
                    optimizers[role].zero_grad()
                    (found["loss_objective"] + found["loss_critic"] + found["loss_entropy"]).backward()
                    nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                    optimizers[role].step()
        now = time.process_time()
        cpu_s, began = cpu_s + now - began, now
        if cpu_s >= args.cpu_seconds * len(rows) / args.judgements:
            rows.append((cpu_s, *judge(env, losses, args).values()))
            report(args, rows[-1])
            began = time.process_time()
        if len(rows) > args.judgements:
            break
    return rows


def report(args: Args, row: tuple[float, ...]) -> None:
    """One line of the table."""
    usual = find_problem(args.problem).opponents["learning"]
    against = [usual[role].partition("?")[0] for role in reversed(types.ROLES)]
    if row[0] == 0:
        print("paid to the attacker in episodes")
        print(f" CPU s   learned attacker against {against[0]}   learned defender against {against[1]}")
    print(f"{row[0]:6.1f}   {row[1]:{25 + len(against[0])}.3f}   {row[2]:{25 + len(against[1])}.3f}", flush=True)


def draw(args: Args, rows: list[tuple[float, ...]]) -> None:
    """The table as curves."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
    for place, role in enumerate(types.ROLES):
        axes[place].plot([row[0] for row in rows], [row[1 + place] for row in rows], marker="o")
        axes[place].set(title=f"learned {role}", xlabel="CPU seconds", ylabel="paid to the attacker", ylim=(0, None))
    figure.savefig(args.png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for each in fields(Args):
        parser.add_argument(f"--{each.name.replace('_', '-')}", type=type(each.default), default=each.default)
    chosen = Args(**vars(parser.parse_args()))
    curves = train(chosen)
    if chosen.png:
        draw(chosen, curves)
