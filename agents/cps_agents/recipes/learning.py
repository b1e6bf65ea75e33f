"""Recipes of our own PPO on preset `learning`, from reward alone: settings are those of `Problem.training`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from cps_agents.learning.recipe import Ppo, Recipe, changed
from cps_envs.core.declare.panel import mixed
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Problem
from cps_envs.core.types import Role
from cps_envs.fdi import panels as fdi
from cps_envs.hvac import panels as hvac

PPO = {entry.name for entry in fields(Ppo)}
USUAL_STEPS = 3_000_000  # of a problem of one's own

# What a role needs beside the settings that every library is told, and how long it learns: some two CPU minutes on the
# machine that they were measured on.
OWN: Mapping[tuple[str, Role], Mapping[str, Any]] = {
    # Four or five decisions in an episode, and what is drawn in it decides the most.
    ("disbanding", "attacker"): {
        "adapter": "timed",
        "frame_skip": 30,
        "n_steps": 12,
        "learning_rate": 2e-3,
        "final_learning_rate": 2e-4,
        "gae_lambda": 0.99,
        "total_timesteps": 800_000,
        "copies": 4,
        "num_envs": 48,
        "batch_size": 128,
        "n_epochs": 4,
        "target_kl": 0.05,
        "ent_coef": 0.03,
        "evaluations": 3,
        "evaluation_episodes": 144,
    },
    ("disbanding", "defender"): {  # what one platoon does for a while hardly shows: noise that lasts, and renewed plans
        "n_steps": 1,
        "batch_size": 64,
        "n_epochs": 4,
        "ent_coef": 0.0,
        "gae_lambda": 1.0,
        "total_timesteps": 2_400_000,
        "adapter": "follow",
        "frame_skip": 100,
        "relative": False,
        "episode_noise": True,
        "initial_deviation": 0.15,
        "learning_rate": 3e-4,
        "final_learning_rate": 3e-5,
        "bias_learning_rate": 0.05,
        "num_envs": 48,
        "evaluations": 3,
    },
    ("rogue", "attacker"): {  # scattered platoons pay until the end, so it looks far ahead
        "total_timesteps": 400_000,
        "gamma": 0.996,
        "evaluations": 3,
        "evaluation_episodes": 192,
    },
    ("rogue", "defender"): {  # begins as `guard`, and learns where vehicles near a suspect do better
        "total_timesteps": 1_800_000,
        "adapter": "guard",
        "frame_skip": 5,
        "recent_s": (3.0, 20.0),
        "rough_s": 1.0,
        "neutral_bias": 3.0,
        "shared_pay": False,
        "n_steps": 64,
        "batch_size": 4096,
        "n_epochs": 5,
        "learning_rate": 3e-3,
        "final_learning_rate": 3e-4,
        "ent_coef": 0.0,
        "gamma": 0.98,
        "gae_lambda": 0.9,
        "target_kl": 0.03,
        "evaluations": 4,
        "evaluation_episodes": 512,
    },
    ("hvac", "attacker"): {
        "total_timesteps": 5_000_000,
        "opponent": mixed(hvac.RECIPES["defender"]),
        "pay_power": 0.5,
        "evaluations": 2,
        "evaluation_episodes": 256,
    },
    # What was used lately tells the defenders apart.
    ("fdi", "attacker"): {
        "total_timesteps": 4_000_000,
        "opponent": mixed(fdi.RECIPES["defender"]),
        "recent_s": (1.0, 4.0),
        "hidden": (96, 96),
        "num_envs": 512,
        "batch_size": 1024,
        "n_epochs": 4,
        "ent_coef": 0.003,
        "evaluations": 4,
        "evaluation_episodes": 1024,
    },
    ("fdi", "defender"): {
        "total_timesteps": 1_000_000,
        "opponent": mixed(fdi.RECIPES["attacker"]),
        "frame_skip": 3,
        "neutral_bias": 2.0,
        "n_steps": 17,
        "n_epochs": 3,
        "learning_rate": 7e-3,
        "final_learning_rate": 0.1 * 7e-3,
        "target_kl": 0.03,
        "rows_per_update": 12_288,
        "evaluations": 6,
        "evaluation_episodes": 512,
    },
    ("hvac", "defender"): {  # begins as `bayes`, whose choices are seldom wrong, and learns from what differs
        "total_timesteps": 500_000,
        "adapter": "bayes",
        "frame_skip": 10,
        "recent_s": (3600.0, 14400.0),
        "initial_deviation": 0.25,
        "relative": True,
        "learning_rate": 2e-3,
        "final_learning_rate": 2e-4,
        "num_envs": 128,
        "n_steps": 36,
        "batch_size": 4608,
        "n_epochs": 5,
        "gamma": 0.98,
        "gae_lambda": 0.9,
        "target_kl": 0.03,
        "evaluations": 2,
        "evaluation_episodes": 256,
    },
}


def learning_recipe(problem: Problem, role: Role, reference: str = "") -> Recipe:
    """The recipe `rogue-attack`, and so on; `reference` finds a problem of one's own."""
    training = problem.training.get(role, Training())
    told = {name: value for name, value in training.ppo.items() if name in PPO}
    told = {"final_learning_rate": 0.1 * told.get("learning_rate", Ppo.learning_rate), **told}
    side = {"attacker": "attack", "defender": "defense"}[role]
    usual = Recipe(
        name=f"{problem.name}-{side}",
        problem=reference or problem.name,
        role=role,
        training=replace(training, ppo={}, total_timesteps=USUAL_STEPS),
        ppo=Ppo(**told),
    )
    return changed(usual, OWN.get((problem.name, role), {}))
