"""The rogue-vehicle problem as the interfaces see it."""

from __future__ import annotations

from cps_envs.core.declare.panel import mixed, references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.rogue.config import PRESETS, RogueConfig
from cps_envs.rogue.panels import OPPONENTS, TRAINING


def vehicle_steps(config: RogueConfig) -> float:
    """Integration steps of single vehicles in a game step; a function of its own so that problems pickle."""
    return config.steps_per_period * config.max_vehicles


ROGUE = Problem(
    name="rogue",
    version=0,
    summary="An attacker drives one vehicle of a platoon to cause collisions. A defender drives the others.",
    presets=PRESETS,
    game=Later("cps_envs.rogue.game:RogueGame"),
    fields={
        "attacker": Later("cps_envs.rogue.fields:attacker_fields"),
        "defender": Later("cps_envs.rogue.fields:defender_fields"),
    },
    opponents=references(OPPONENTS),
    viewer="cps_envs.rogue.picture.viewer:RogueViewer",
    swarm={"defender": "vehicle_full"},
    discrete=("defender",),
    unit="m/s",
    work=Work(unit="vehicle-steps", per_game_step=vehicle_steps),
    training={
        "attacker": Training(
            adapter="effort",
            frame_skip=2,
            recent_s=(0.4, 1.6),
            run_s=5.0,
            num_envs=128,
            ppo={"n_steps": 64, "batch_size": 2048, "n_epochs": 4, "learning_rate": 1.5e-3, "ent_coef": 0.003},
        ),
        "defender": Training(  # begins as `guard`, and learns where vehicles near a suspect do better
            adapter="guard",
            opponent=mixed(TRAINING["attacker"]),
            frame_skip=5,
            recent_s=(3.0, 20.0),
            rough_s=1.0,
            neutral_bias=3.0,
            ppo={
                "n_steps": 64,
                "batch_size": 4096,
                "n_epochs": 5,
                "learning_rate": 3e-3,
                "final_learning_rate": 3e-4,
                "gamma": 0.98,
                "gae_lambda": 0.9,
                "target_kl": 0.03,
            },
        ),
    },
)
