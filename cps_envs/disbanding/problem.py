"""The disbanding problem as the interfaces see it."""

from __future__ import annotations

from pathlib import Path

from cps_envs.core.declare.panel import mixed, references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.disbanding.config import OF_VEHICLES, PRESETS, ROAD, DisbandingConfig
from cps_envs.disbanding.panels import OPPONENTS, TRAINING


def vehicle_steps(config: DisbandingConfig) -> float:
    """Integration steps of single vehicles in a game step; a function of its own so that problems pickle."""
    return config.max_vehicles * config.steps_per_period


DISBANDING = Problem(
    name="disbanding",
    version=0,
    summary="An attacker disbands vehicle platoons. A defender keeps the traffic behind from stopping and crashing.",
    presets=PRESETS,
    scaling=Path(__file__).with_name("scaling.json"),
    cost="collided_intact",
    cost_limit=0.0,
    game=Later("cps_envs.disbanding.game:DisbandingGame"),
    fields={
        "attacker": Later("cps_envs.disbanding.fields:attacker_fields"),
        "defender": Later("cps_envs.disbanding.fields:defender_fields"),
    },
    opponents=references(OPPONENTS),
    recorded={
        "position": ("position_m", "m", "front to rear"),
        "speed": ("speed_mps", "m/s", "front to rear"),
        "spacing": ("spacing_m", "m", "between the positions of each vehicle and the one ahead"),
        "disbanding_s": ("disbanding_s", "s", "when each platoon was disbanded; inf if intact"),
        "collided": ("collided", "-", "1 once in a collision"),
    },
    viewer="cps_envs.disbanding.picture.viewer:DisbandingViewer",
    swarm={"defender": "vehicle"},
    unit="points of E_v and of the penalty for collisions",
    work=Work(unit="vehicle-steps", per_game_step=vehicle_steps),
    foreign=Later("cps_envs.disbanding.foreign:foreign"),
    system=(*OF_VEHICLES, *ROAD),
    training={
        "attacker": Training(
            adapter="from_front",
            frame_skip=60,
            opponent=mixed(TRAINING["defender"]),
            practised={"quiet_share": 0.0},  # nothing can be done in a quiet episode
            num_envs=64,
            total_timesteps=40_000,
            ppo={
                "n_steps": 12,
                "batch_size": 128,
                "n_epochs": 6,
                "learning_rate": 1e-3,
                "gamma": 1.0,
                "ent_coef": 0.003,
            },
        ),
        "defender": Training(
            adapter="parts_road",
            frame_skip=100,
            opponent=mixed(TRAINING["attacker"]),
            practised={"quiet_share": 0.1},  # where little happens, little is learned
            num_envs=32,
            total_timesteps=20_000,
            ppo={
                "n_steps": 18,
                "batch_size": 144,
                "n_epochs": 6,
                "learning_rate": 1e-3,
                "gamma": 1.0,
                "ent_coef": 0.003,
            },
        ),
    },
)
