"""The HVAC problem as the interfaces see it."""

from __future__ import annotations

from cps_envs.core.declare.panel import references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.hvac.config import PRESETS, HvacConfig
from cps_envs.hvac.panels import OPPONENTS


def sensor_steps(config: HvacConfig) -> float:
    """Closed-loop steps in a game step, times the sensors; a function of its own so that problems pickle."""
    return config.num_sensors


# All chosen, by trials. A lie pays with the square of its size, so a policy that draws levels at random sees little of
# it: an untrained one keeps its level for two hours, which is the same for all compromised sensors ("together"). Nine
# tenths of the training days have two or three of them, which is where attacks pay.
ATTACK = Training(
    adapter="together",
    frame_skip=15,
    run_s=7200.0,
    pay_power=0.5,
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
    frame_skip=10,
    recent_s=(3600.0, 14400.0),
    neutral_bias=2.5,
    num_envs=128,
    total_timesteps=1_000_000,
    ppo={
        "n_steps": 36,
        "batch_size": 4608,
        "n_epochs": 5,
        "gamma": 0.98,
        "gae_lambda": 0.9,
        "learning_rate": 5e-3,
        "final_learning_rate": 1e-3,
        "target_kl": 0.03,
    },
)

HVAC = Problem(
    name="hvac",
    version=0,
    summary="An attacker forges temperature sensors of a heated building. A defender chooses which ones to believe.",
    presets=PRESETS,
    game=Later("cps_envs.hvac.game:HvacGame"),
    fields={
        "attacker": Later("cps_envs.hvac.observation:attacker_fields"),
        "defender": Later("cps_envs.hvac.observation:defender_fields"),
    },
    opponents=references(OPPONENTS),
    viewer="cps_envs.hvac.picture.viewer:HvacViewer",
    unit="A_impact, C2",
    swarm={"defender": "sensor"},
    training={"attacker": ATTACK, "defender": DEFENSE},
    work=Work(unit="sensor-steps", per_game_step=sensor_steps),
)
