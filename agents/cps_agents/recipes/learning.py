"""Recipes of our own PPO on preset `learning`, from reward alone: settings are those of `Problem.training`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_agents.learning.recipe import Recipe
from cps_envs.core.declare.panel import mixed
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Problem
from cps_envs.core.types import Role
from cps_envs.disbanding import panels as disbanding
from cps_envs.fdi import panels as fdi
from cps_envs.hvac import panels as hvac
from cps_envs.rogue import panels as rogue

KNOBS: Mapping[str, str] = {  # of stable-baselines3's PPO, as ours are called
    "final_learning_rate": "final_learning_rate",
    "n_steps": "steps_per_update",
    "n_epochs": "epochs",
    "gamma": "discount",
    "ent_coef": "entropy_bonus",
    "vf_coef": "value_weight",
    **{
        name: name for name in ("batch_size", "learning_rate", "gae_lambda", "clip_range", "target_kl", "max_grad_norm")
    },
}
STEPS: Mapping[tuple[str, Role], int] = {  # chosen: some two CPU minutes on the machine that they were measured on
    ("disbanding", "attacker"): 800_000,
    ("disbanding", "defender"): 2_400_000,
    ("fdi", "attacker"): 4_000_000,
    ("fdi", "defender"): 1_000_000,
    ("hvac", "attacker"): 5_000_000,
    ("hvac", "defender"): 500_000,
    ("rogue", "attacker"): 2_000_000,
    ("rogue", "defender"): 1_800_000,
}
USUAL_STEPS = 3_000_000  # of a problem of one's own
# What a role needs beside the settings that every library is told, and how long it learns.
OWN: Mapping[tuple[str, Role], Mapping[str, Any]] = {
    # Four or five decisions in an episode, and what is drawn in it decides the most.
    ("disbanding", "attacker"): {
        "copies": 4,
        "num_envs": 48,
        "batch_size": 128,
        "epochs": 4,
        "target_kl": 0.05,
        "entropy_bonus": 0.03,
        "evaluations": 3,
        "evaluation_episodes": 144,
    },
    ("disbanding", "defender"): {  # what one platoon does for a while hardly shows: noise that lasts, and renewed plans
        "adapter": "follow",
        "hold": 100,
        "relative": False,
        "episode_noise": True,
        "opponent": mixed(disbanding.RECIPES["attacker"]),
        "initial_deviation": 0.15,
        "learning_rate": 3e-4,
        "final_learning_rate": 3e-5,
        "bias_learning_rate": 0.05,
        "num_envs": 48,
        "evaluations": 3,
    },
    ("rogue", "attacker"): {  # scattered platoons pay until the end, so it looks far ahead
        "opponent": mixed(rogue.RECIPES["defender"]),
        "num_envs": 256,
        "steps_per_update": 32,
        "discount": 0.996,
        "evaluations": 3,
        "evaluation_episodes": 192,
    },
    ("rogue", "defender"): {"evaluations": 4, "evaluation_episodes": 512},
    ("hvac", "attacker"): {
        "opponent": mixed(hvac.RECIPES["defender"]),
        "evaluations": 2,
        "evaluation_episodes": 256,
    },
    # What was used lately tells the defenders apart.
    ("fdi", "attacker"): {
        "opponent": mixed(fdi.RECIPES["defender"]),
        "recent_s": (1.0, 4.0),
        "hidden": (96, 96),
        "num_envs": 512,
        "batch_size": 1024,
        "epochs": 4,
        "entropy_bonus": 0.003,
        "evaluations": 4,
        "evaluation_episodes": 1024,
    },
    ("fdi", "defender"): {
        "opponent": mixed(fdi.RECIPES["attacker"]),
        "rows_per_update": 12_288,
        "evaluations": 6,
        "evaluation_episodes": 512,
    },
    ("hvac", "defender"): {  # begins as `bayes`, whose choices are seldom wrong, and learns from what differs
        "adapter": "bayes",
        "initial_deviation": 0.25,
        "relative": True,
        "learning_rate": 2e-3,
        "final_learning_rate": 2e-4,
        "num_envs": 128,
        "evaluations": 2,
        "evaluation_episodes": 256,
    },
}


def learning_recipe(problem: Problem, role: Role, reference: str = "") -> Recipe:
    """The recipe `rogue-attack`, and so on; `reference` finds a problem of one's own."""
    training = problem.training.get(role, Training())
    side = {"attacker": "attack", "defender": "defense"}[role]
    given = {KNOBS[name]: value for name, value in training.ppo.items() if name in KNOBS}
    rate = float(given.get("learning_rate", 1e-3))
    knobs: dict[str, Any] = {
        "total_steps": STEPS.get((problem.name, role), USUAL_STEPS),
        "batch_size": 4096,
        "steps_per_update": 64,
        "target_kl": 0.03,
        "discount": 0.99,
        "learning_rate": rate,
        "final_learning_rate": 0.1 * rate,
        "adapter": training.adapter,
        "opponent": training.opponent,
        "hold": training.frame_skip,
        "recent_s": training.recent_s,
        "rough_s": training.rough_s,
        "run_s": training.run_s,
        "neutral_bonus": training.neutral_bias,
        "initial_deviation": training.initial_deviation,
        "pay_power": training.pay_power,
        "relative": training.relative,
        "num_envs": training.num_envs,
    }
    own = OWN.get((problem.name, role), {})
    name = f"{problem.name}-{side}"
    return Recipe(name=name, problem=reference or problem.name, role=role, **{**knobs, **given, **own})
