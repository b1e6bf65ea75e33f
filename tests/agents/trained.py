"""A tiny trained policy for tests that need one, made without PyTorch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save
from cps_agents.zoo.network import Network
from cps_agents.zoo.wired import Head, card_entry, count_actions
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.learning.wiring import Wired, Wiring
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.types import Role
from cps_envs.registration import find_problem


def tiny_network(inputs: int, outputs: int, seed: int = 0) -> Network:
    generator = np.random.default_rng(seed)
    return Network(
        columns=np.arange(inputs),
        mean=np.zeros(inputs, np.float32),
        deviation=np.ones(inputs, np.float32),
        layers=((generator.normal(size=(inputs, outputs)).astype(np.float32), np.zeros(outputs, np.float32)),),
        activation="tanh",
        log_deviation=np.full(outputs, -1.0, np.float32),
    )


def save_tiny(
    path: Path,
    problem_name: str,
    role: Role,
    *,
    preset: str = "paper",
    overrides: dict[str, Any] | None = None,
    swarm: bool = False,
    frame_skip: int = 1,
    seeds: int = 2,
    **changes: Any,
) -> Card:
    """Write a policy with random weights to `path` (its card) that fits a role of a configuration."""
    problem = find_problem(problem_name)
    game = problem.game(problem.config(preset, overrides or {}), 1)
    masked = game.action_mask(role) is not None
    team = {"rogue": "vehicle_full"}.get(problem_name, problem.swarm.get(role, NATIVE))  # one that fits every preset
    wiring = Wiring(problem_name, role, team if swarm else NATIVE, frame_skip, masked=masked)
    wired = Wired(wiring, adapter_of(game.spec(role), wiring.adapter))
    actions, size = count_actions(wired.adapter.action_space), wired.columns.size
    card = Card(
        **{
            "name": path.stem,
            "problem": problem_name,
            "version": problem.version,
            "role": role,
            "algorithm": "shared-ppo",
            "opponent": "none",
            "preset": preset,
            "overrides": overrides or {},
            "recipe": {"evaluation_episodes": 2},
            "activation": "tanh",
            "head": "discrete" if wired.choices else "gaussian",
            "decentralised": swarm,
            "observation_size": size,
            "actions": actions,
            "best": 0,
            "seeds": {str(seed): {"validation": float(-seed), "steps": 1} for seed in range(seeds)},
            "command": "cps-envs train",
            "versions": {},
            "wiring": card_entry(wiring, Head()),
            **changes,
        }
    )
    return save(path, card, {seed: tiny_network(size, sum(actions), seed) for seed in range(seeds)})
