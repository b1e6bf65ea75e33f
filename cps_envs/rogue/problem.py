"""The rogue-vehicle problem as the interfaces see it."""

from __future__ import annotations

from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.rogue.config import PRESETS, RogueConfig

EASY_ATTACKERS = (
    'mixture?policies=["square?frequency_hz=0.05","square","duty_square?frequency_hz=0.05","duty_square","random",'
    '"switching"]'
)
EASY_DEFENDERS = 'mixture?policies=["pd","sliding","sliding_detection","disband_2","disband_4","disband_7"]'
ATTACKERS = (
    'mixture?policies=["none","square?frequency_hz=0.05","duty_square","random","strike","switching",'
    '"contested?against=sliding","contested?against=monitor","identify","always?action=-1"]'
)
# Attackers of differing kinds, which a learning defender meets; others are left for judging.
TRAINING_ATTACKERS = (
    'mixture?policies=["none","square","square?frequency_hz=0.05","duty_square","random","strike","switching",'
    '"contested?against=sliding","contested?against=monitor","contested?against=pd","contested?against=disband_7",'
    '"contested?against=assigned?laws=f","identify","always?action=-1"]&weights=[1,2,1,1,1,1,1,3,3,1,1,1,2,1]'
)


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
    opponents={
        "paper": {"attacker": "square", "defender": "none"},
        "oscillation": {"attacker": "gains", "defender": "none"},
        "seats": {"attacker": "square", "defender": "none"},
        "easy": {"attacker": EASY_ATTACKERS, "defender": EASY_DEFENDERS},
        "learning": {"attacker": ATTACKERS, "defender": "monitor"},
    },
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
            opponent=TRAINING_ATTACKERS,
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
