"""The rogue-vehicle problem as the interfaces see it."""

from __future__ import annotations

from pathlib import Path

from cps_envs.core.declare.panel import mixed, references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.rogue.config import OF_VEHICLES, PRESETS, RogueConfig
from cps_envs.rogue.panels import OPPONENTS, TRAINING


def vehicle_steps(config: RogueConfig) -> float:
    """Integration steps of single vehicles in a game step; a function of its own so that problems pickle."""
    return config.steps_per_period * config.max_vehicles


ROGUE = Problem(
    name="rogue",
    version=0,
    summary="An attacker drives one vehicle of a platoon to cause collisions. A defender drives the others.",
    presets=PRESETS,
    scaling=Path(__file__).with_name("scaling.json"),
    cost="collisions",
    cost_limit=0.0,
    game=Later("cps_envs.rogue.game:RogueGame"),
    fields={
        "attacker": Later("cps_envs.rogue.fields:attacker_fields"),
        "defender": Later("cps_envs.rogue.fields:defender_fields"),
    },
    opponents=references(OPPONENTS),
    recorded={
        "position": ("position_m", "m", "of the centres, from the rear"),
        "speed": ("speed_mps", "m/s", "from the rear"),
        "acceleration": ("acceleration_mps2", "m/s2", "from the rear"),
        "gap": ("gap_m", "m", "between the bumpers of each pair"),
        "effort": ("effort_in_force", "-", "of the seized vehicle, of its engine"),
        "reference_m": ("reference_m", "m", "where the leader ought to be"),
        "alarm": ("alarm", "-", "1 blames the vehicle ahead, -1 the one behind"),
        "attacker": ("seat", "-", "of the seized vehicle, 0 = rear"),
    },
    viewer="cps_envs.rogue.picture.viewer:RogueViewer",
    swarm={"defender": "give_way_vehicle"},
    unit="m/s",
    units={"contact": ("pass", "m")},  # how far vehicles have been inside one another
    work=Work(unit="vehicle-steps", per_game_step=vehicle_steps),
    foreign=Later("cps_envs.rogue.foreign:foreign"),
    system=(*OF_VEHICLES, "max_effort", "min_effort", "separation_m", "reference_speed_mps"),
    training={
        "attacker": Training(  # what an effort does shows in the gaps after about 2 s
            adapter="effort",
            opponent=mixed(TRAINING["defender"]),
            frame_skip=20,
            recent_s=(0.4, 1.6),
            num_envs=128,
            ppo={"n_steps": 32, "batch_size": 2048, "n_epochs": 4, "learning_rate": 1.5e-3, "ent_coef": 0.003},
        ),
        "defender": Training(
            adapter="give_way",
            opponent=mixed(TRAINING["attacker"]),
            frame_skip=12,
            shared_pay=True,  # who asks is not who is hit
            num_envs=128,
            ppo={"n_steps": 50, "batch_size": 256, "n_epochs": 8, "learning_rate": 1e-3, "ent_coef": 0.003},
        ),
    },
)
