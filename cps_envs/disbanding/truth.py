"""What an episode hides from the roles, for value functions in training only."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.state import State

# What brings a quantity to about unit size, all chosen.
HEADWAY_S = (1.5, 0.3)  # middle, and what counts as 1 from it
DELAY_S, BRAKING_MPS2, SPEED_MPS, JAM_S, OPENING_S, HOP_S, ATTACKS = 2.0, 5.0, 31.0, 10.0, 60.0, 0.1, 2.0


def truth_of_road(config: DisbandingConfig, state: State, constants: Array, budget: IntArray) -> Observation:
    """The road (B, 5), then each platoon from the front (B, 6 N), as float32."""
    platoons = _platoons(config, state, constants)
    parts = (_road(state, constants, budget), platoons.reshape(len(platoons), -1))
    return np.concatenate(parts, axis=1).astype(np.float32)


def truth_of_platoons(config: DisbandingConfig, state: State, constants: Array, budget: IntArray) -> Observation:
    """For each platoon from the front (B, N, 23): the road, the platoon itself, the means of those ahead and behind."""
    own = _platoons(config, state, constants)
    road = np.repeat(_road(state, constants, budget)[:, np.newaxis], own.shape[1], axis=1)
    upto, count = own.cumsum(axis=1), np.arange(own.shape[1])[:, np.newaxis]
    ahead = (upto - own) / np.maximum(count, 1)
    behind = (upto[:, -1:] - upto) / np.maximum(own.shape[1] - 1 - count, 1)
    return np.concatenate([road, own, ahead, behind], axis=2).astype(np.float32)


def _road(state: State, constants: Array, budget: IntArray) -> FloatArray:
    """(B, 5): attacks and jamming that are left, when attacks become legal, and how good the radio is."""
    dt_s = constants["dt_s"]
    opens_s = np.maximum(state.opening_s - state.step * dt_s, 0.0)
    jam_s, hop_s = state.jam_steps * dt_s, constants["hop_steps"] * dt_s
    return np.stack(
        [budget / ATTACKS, jam_s / JAM_S, opens_s / OPENING_S, hop_s / HOP_S, constants["hop_loss"]], axis=1
    )


def _platoons(config: DisbandingConfig, state: State, constants: Array) -> FloatArray:
    """(B, N, 6): disbanded; means of the drivers' headway, delay and braking; mean speed; share in collisions."""

    def mean(values: Array) -> FloatArray:
        means: FloatArray = values.reshape(len(values), config.max_platoons, -1).mean(axis=2)
        return means

    time_s = (state.step * constants["dt_s"])[:, np.newaxis]
    return np.stack(
        [
            state.disbanding_s <= time_s,
            (mean(state.driver_headway_s) - HEADWAY_S[0]) / HEADWAY_S[1],
            mean(state.takeover_delay_s) / DELAY_S,
            mean(state.braking_mps2 * (state.braking_s > 0)) / BRAKING_MPS2,
            mean(state.speed) / SPEED_MPS,
            mean(state.collided),
        ],
        axis=2,
    )
