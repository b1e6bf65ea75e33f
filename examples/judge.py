"""What the short programs of this folder share: their arguments, and a judgement on episodes that training never saw.

A program hands `run` its function `train(role, cpu_seconds)`, which returns how the trained network acts: observations
(n, inputs) in, actions (n, ...) out. After training for no time at all it returns the untrained network. A function
with a parameter `action_masks` also gets what is legal now (n, choices), or None if everything is.
"""

from __future__ import annotations

import argparse
import inspect
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import cps_envs  # noqa: F401  registers the environments

Act = Callable[..., Any]
EPISODES = 200
SEED = 700_000  # of the first of them


def returns(role: str, act: Act, episodes: int = EPISODES, seed: int = SEED, **options: Any) -> np.ndarray:
    """What the role is paid in each episode (episodes,), the agents of a team together."""
    envs: Any = gymnasium.make_vec(f"cps_envs/{role}-v0", episodes, autoreset="same_step", **options)
    observations, _ = envs.reset(seed=seed)
    masked = "action_masks" in inspect.signature(act).parameters
    has_masks = hasattr(envs, "action_masks")
    paid, running = np.zeros(envs.num_envs), np.ones(envs.num_envs, np.bool_)
    while running.any():
        legal = {"action_masks": envs.action_masks() if has_masks else None} if masked else {}
        actions = np.asarray(act(observations, **legal)).reshape(envs.action_space.shape)
        observations, reward, terminated, truncated, _ = envs.step(actions)
        paid += np.where(running, reward, 0.0)
        running &= ~(terminated | truncated)
    return paid.reshape(episodes, -1).sum(axis=1)


def run(
    train: Callable[..., Act], about: str | None, role: str, algorithms: Sequence[str] = (), **options: Any
) -> None:
    """Train as the command line says, and print the mean return of the untrained and of the trained network.

    With `algorithms` the command line names one of them, which `train` gets as its third argument. `options` are those
    of the environment that the role is judged in, such as `per_agent=True`.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--role", default=role, help="such as FdiAttack, HvacDefense or RogueAttack; %(default)s")
    parser.add_argument("--cpu-seconds", type=float, default=60.0, help="of training; %(default)s")
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of the judgement; %(default)s")
    parser.add_argument("--out", type=Path, help="a file for what was paid in each episode, as JSON")
    if algorithms:
        parser.add_argument("--algorithm", choices=algorithms, default=algorithms[0], help="%(choices)s; %(default)s")
    args = parser.parse_args()
    more = [args.algorithm] if algorithms else []
    found = {
        name: returns(args.role, train(args.role, budget, *more), args.episodes, **options)
        for name, budget in (("before", 0.0), ("after", args.cpu_seconds))
    }
    if args.out:
        args.out.write_text(json.dumps({name: each.tolist() for name, each in found.items()}), encoding="utf-8")
    print("return " + ", ".join(f"{name} {each.mean():.3f}" for name, each in found.items()))
