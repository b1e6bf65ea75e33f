"""The disbanding problem as the interfaces see it."""

from __future__ import annotations

from cps_envs.core.declare.panel import mixed, references
from cps_envs.core.declare.training import Training
from cps_envs.core.game.problem import Later, Problem, Work
from cps_envs.disbanding.config import PRESETS, DisbandingConfig
from cps_envs.disbanding.panels import OPPONENTS, TRAINING


def vehicle_steps(config: DisbandingConfig) -> float:
    """Integration steps of single vehicles in a game step; a function of its own so that problems pickle."""
    return config.max_vehicles * config.steps_per_period


DISBANDING = Problem(
    name="disbanding",
    version=0,
    summary="An attacker disbands vehicle platoons. A defender keeps the traffic behind from stopping and crashing.",
    presets=PRESETS,
    game=Later("cps_envs.disbanding.game:DisbandingGame"),
    fields={
        "attacker": Later("cps_envs.disbanding.fields:attacker_fields"),
        "defender": Later("cps_envs.disbanding.fields:defender_fields"),
    },
    opponents=references(OPPONENTS),
    viewer="cps_envs.disbanding.picture.viewer:DisbandingViewer",
    swarm={"defender": "vehicle"},
    unit="points of E_v and of the penalty for collisions",
    work=Work(unit="vehicle-steps", per_game_step=vehicle_steps),
    training={
        "attacker": Training(
            adapter="timed",
            opponent=mixed(TRAINING["defender"]),
            total_timesteps=500_000,
            ppo={
                "n_steps": 180,
                "batch_size": 2880,
                "n_epochs": 4,
                "learning_rate": 2e-3,
                "final_learning_rate": 2e-4,
                "gamma": 1.0,
                "gae_lambda": 0.99,
                "ent_coef": 0.003,
            },
        ),
        # One decision in an episode: what is tried has to last. A linear policy has few numbers for so few decisions.
        # With a larger deviation more vehicles collide, and a few such episodes hide what the others say.
        "defender": Training(
            adapter="follow_road",
            frame_skip=1800,
            initial_deviation=0.1,
            relative=True,
            total_timesteps=1_500,
            ppo={
                "n_steps": 1,
                "batch_size": 64,
                "n_epochs": 4,
                "learning_rate": 8e-3,
                "final_learning_rate": 8e-4,
                "gamma": 1.0,
                "gae_lambda": 1.0,
                "policy_kwargs": {"net_arch": []},
            },
        ),
    },
)
