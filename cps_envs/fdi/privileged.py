"""What an episode hides, for the value functions of learners while they train; no policy may see it."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.types import BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.state import State

GAP_M = 3.0  # of errors and lies that are shown as 1; chosen, as are all of these
SPEED_MPS = 2.0
MOST = 8.0


def hidden_from_attacker(config: FdiConfig, state: State) -> Observation:
    """The disturbances of the vehicles now and the next ones, (B, 2n), of which the largest deviation is 1."""
    blocks = state.disturbance.shape[1]
    if blocks == 0:
        return np.zeros((len(state.step), 0), np.float32)
    now = (state.step[:, np.newaxis] + state.phase) // config.hold_steps  # (B, n)
    rows = np.minimum(np.stack([now, now + 1], axis=1), blocks - 1)  # (B, 2, n)
    shown = np.take_along_axis(state.disturbance, rows, axis=1) / bounds(config.disturbance_mps2)[1]
    return _told(shown.reshape(len(now), -1))


def hidden_from_defender(config: FdiConfig, state: State, attacked: BoolArray) -> Observation:
    """The true errors, the lies, who is attacked (B, R) in `attacked`, whether that works now: (B, 2n + 2R + 1)."""
    ranges = config.num_readings // 2
    errors = state.error / np.repeat([GAP_M, SPEED_MPS], config.num_vehicles)
    lies = state.injection / np.repeat([GAP_M, SPEED_MPS], [ranges, config.num_readings - ranges])
    return _told(np.concatenate([errors, lies, attacked, _works(state)[:, np.newaxis]], axis=1))


def hidden_from_sensors(config: FdiConfig, state: State, attacked: BoolArray, gaps: IntArray) -> Observation:
    """For each sensor (B, A, 11) of the gaps (A,).

    The true errors of its gap, its own lies and whether its readings are attacked; whether attacks work now, whether
    they ever do, and how many readings are attacked; the smallest gap error of all and the fastest closing.
    """
    n, half = config.num_vehicles, config.num_readings // 2
    gap, speed = state.error[:, :n] / GAP_M, state.error[:, n:] / SPEED_MPS
    ranges, rates = slice(None, half), slice(half, None)
    common = np.stack(
        [_works(state), state.onset < config.horizon, attacked.mean(axis=1), gap.min(axis=1), speed.min(axis=1)], axis=1
    )
    own = np.stack(
        [
            gap[:, gaps],
            speed[:, gaps],
            state.injection[:, ranges] / GAP_M,
            state.injection[:, rates] / SPEED_MPS,
            attacked[:, ranges],
            attacked[:, rates],
        ],
        axis=2,
    )
    return _told(np.concatenate([own, np.repeat(common[:, np.newaxis], half, axis=1)], axis=2))


def _works(state: State) -> BoolArray:
    """Whether injections may change the readings of now, (B,)."""
    works: BoolArray = state.step >= state.onset
    return works


def _told(values: FloatArray) -> Observation:
    return values.clip(-MOST, MOST).astype(np.float32)
