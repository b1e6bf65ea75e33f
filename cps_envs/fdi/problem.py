"""The false-data-injection problem as the interfaces see it."""

from __future__ import annotations

from pathlib import Path

from cps_envs.core.declare.panel import references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.fdi.config import PRESETS, SYSTEM, FdiConfig
from cps_envs.fdi.panels import OPPONENTS


def vehicle_steps(config: FdiConfig) -> float:
    """Steps of single vehicles in a game step of an episode; a function of its own so that problems pickle."""
    return config.num_vehicles


FDI = Problem(
    name="fdi",
    version=0,
    summary="An attacker falsifies distance sensors to make vehicles collide. A defender decides which to believe.",
    presets=PRESETS,
    scaling=Path(__file__).with_name("scaling.json"),
    cost="collided_pairs",
    cost_limit=0.0,
    game=Later("cps_envs.fdi.game:FdiGame"),
    fields={
        "attacker": Later("cps_envs.fdi.observation:attacker_fields"),
        "defender": Later("cps_envs.fdi.observation:defender_fields"),
    },
    opponents=references(OPPONENTS),
    recorded={
        "gap": ("gap_m", "m", "true, ahead of each vehicle from the last on"),
        "closing_speed": ("closing_speed_mps", "m/s", "true"),
        "reported_gap": ("reported_gap_m", "m", "reading"),
        "reported_closing_speed": ("reported_closing_speed_mps", "m/s", "reading"),
        "used_gap": ("used_gap_m", "m", "what was followed"),
        "used_closing_speed": ("used_closing_speed_mps", "m/s", "what was followed"),
        "believed_gap": ("believed_gap_m", "m", "estimate of the filter"),
        "believed_closing_speed": ("believed_closing_speed_mps", "m/s", "estimate of the filter"),
        "command": ("command_mps2", "m/s2", "of each vehicle"),
    },
    viewer="cps_envs.fdi.picture.viewer:FdiViewer",
    swarm={"defender": "sensor"},
    foreign=Later("cps_envs.fdi.foreign:foreign"),
    system=SYSTEM,
    training={
        "attacker": Training(
            adapter="motion",
            frame_skip=5,
            num_envs=256,
            ppo={"gamma": 1.0, "n_steps": 20, "batch_size": 2560, "n_epochs": 4, "learning_rate": 1e-3},
        ),
        "defender": Training(
            adapter="sensor",
            frame_skip=10,
            recent_s=(0.9, 3.6),
            num_envs=128,
            total_timesteps=3_000_000,
            ppo={
                "gamma": 0.98,
                "gae_lambda": 0.9,
                "n_steps": 10,
                "batch_size": 2048,
                "n_epochs": 4,
                "learning_rate": 1e-3,
            },
        ),
    },
    unit="m/s",
    units={"goal": ("instability", "m")},  # what errors have grown
    work=Work(unit="vehicle-steps", per_game_step=vehicle_steps),
)
