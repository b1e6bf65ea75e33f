"""The HVAC problem as the interfaces see it."""

from __future__ import annotations

from pathlib import Path

from cps_envs.core.declare.panel import references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.hvac.config import PRESETS, SYSTEM, HvacConfig
from cps_envs.hvac.panels import OPPONENTS


def sensor_steps(config: HvacConfig) -> float:
    """Closed-loop steps in a game step, times the sensors; a function of its own so that problems pickle."""
    return config.num_sensors


# All chosen, by trials. An episode has 10 to 50 decisions: one lasts about as long as its effect takes to show. Nine
# tenths of the training days have two or three compromised sensors, which is where attacks pay.
ATTACK = Training(
    adapter="together",
    frame_skip=15,
    practised={"compromised_weights": (0.0, 0.1, 0.4, 0.5)},
    num_envs=128,
    total_timesteps=500_000,
    ppo={
        "n_steps": 48,
        "batch_size": 512,
        "n_epochs": 15,
        "gamma": 1.0,
        "gae_lambda": 0.95,
        "learning_rate": 4e-3,
        "final_learning_rate": 4e-4,
        "ent_coef": 0.006,
        "target_kl": 0.03,
    },
)
DEFENSE = Training(
    adapter="sensor",
    frame_skip=30,
    recent_s=(3600.0, 14400.0),
    num_envs=128,
    total_timesteps=500_000,
    ppo={"n_steps": 24, "batch_size": 2048, "n_epochs": 5, "gamma": 0.98, "gae_lambda": 0.9, "learning_rate": 3e-3},
)

HVAC = Problem(
    name="hvac",
    version=0,
    summary="An attacker forges temperature sensors of a heated building. A defender chooses which ones to believe.",
    presets=PRESETS,
    scaling=Path(__file__).with_name("scaling.json"),
    cost="discomfort_h",
    cost_limit=2.0,
    game=Later("cps_envs.hvac.game:HvacGame"),
    fields={
        "attacker": Later("cps_envs.hvac.observation:attacker_fields"),
        "defender": Later("cps_envs.hvac.observation:defender_fields"),
    },
    opponents=references(OPPONENTS),
    recorded={
        "temperature": ("temperature_c", "C", "true, of each zone"),
        "estimate": ("estimate_c", "C", "what the controller was fed"),
        "heating": ("heating_w", "W", "of the last step, as commanded"),
        "supplied": ("supplied_w", "W", "of the last step, what each zone got"),
        "outdoor_c": ("outdoor_c", "C", "outside"),
        "forecast_c": ("forecast_c", "C", "what everybody expects of it"),
        "measured": ("measured_c", "C", "of each sensor, before forging"),
        "reading": ("reading_c", "C", "of each sensor, after forging"),
        "compromised": ("compromised", "-", "1 where the attacker holds the sensor"),
    },
    viewer="cps_envs.hvac.picture.viewer:HvacViewer",
    unit="A_impact, C2",
    swarm={"defender": "sensor"},
    training={"attacker": ATTACK, "defender": DEFENSE},
    work=Work(unit="sensor-steps", per_game_step=sensor_steps),
    foreign=Later("cps_envs.hvac.foreign:foreign"),
    system=SYSTEM,
)
