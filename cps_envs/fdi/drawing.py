"""What resets draw: the task, starts, gains, disturbances, the noise of the sensors, and when the attack begins."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, nearest, pack, unpack, view
from cps_envs.core.compute.streams import between, fill_normal, fill_uniform, uniform, whole
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, BoolArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.state import Batch, State


class Chances(NamedTuple):
    """What is drawn, and from which intervals; what a configuration leaves out is not drawn and shifts nothing else."""

    num_tasks: int
    own_phases: bool
    hold_steps: int
    filters: bool
    attack_share: float
    first_onset_s: float
    last_onset_s: float
    dt_s: float
    horizon: int
    own_constants: bool
    proportional_gain: float
    derivative_gain: float
    gain_spread: float
    least_disturbance_mps2: float
    most_disturbance_mps2: float


def has_own_constants(config: FdiConfig) -> bool:
    """Whether episodes differ in gains or disturbances."""
    return config.gain_spread > 0 or isinstance(config.disturbance_mps2, tuple)


def draws_anything(config: FdiConfig) -> bool:
    """Whether anything is left to chance."""
    spread = config.gap_spread_m > 0 or config.speed_spread_mps > 0
    filters = config.estimator == "kalman"
    return bool(config.tasks) or spread or config.disturbed or has_own_constants(config) or filters


def chances_of(config: FdiConfig, num_tasks: int) -> Array:
    """The chances of a configuration as records (1,)."""
    first_onset_s, last_onset_s = bounds(config.onset_s)
    least_mps2, most_mps2 = bounds(config.disturbance_mps2)
    return pack(
        Chances(
            num_tasks=num_tasks,
            own_phases=config.own_phases,
            hold_steps=config.hold_steps,
            filters=config.estimator == "kalman",
            attack_share=config.attack_share,
            first_onset_s=first_onset_s,
            last_onset_s=last_onset_s,
            dt_s=config.dt_s,
            horizon=config.horizon,
            own_constants=has_own_constants(config),
            proportional_gain=config.proportional_gain,
            derivative_gain=config.derivative_gain,
            gain_spread=config.gain_spread,
            least_disturbance_mps2=least_mps2,
            most_disturbance_mps2=most_mps2,
        )
    )


@kernel
def draw(batch: Batch, streams: Array, envs: BoolArray, chances: Array) -> None:
    """Draw the marked environments (B,) from their streams (B, 6), see `draw_episode`."""
    chance = unpack(Chances, chances, 0)
    for b in range(envs.size):
        if envs[b]:
            row = batch.constants[min(b, batch.constants.size - 1)]
            draw_episode(view(batch.state, b), row, borrowed(streams)[b], chance)


@inlined
def draw_episode(episode: State, row: Record, stream: Array, chance: Chances) -> None:
    """Fill the task of an episode, and numbers that `dynamics.begin` makes errors and disturbances of."""
    episode.task[0] = whole(stream, 0, chance.num_tasks)
    fill_uniform(stream, episode.error)
    if episode.disturbance.size > 0:
        fill_normal(stream, episode.disturbance.reshape(-1))
        if chance.own_phases:
            for i in range(episode.phase.size):
                episode.phase[i] = whole(stream, 0, chance.hold_steps)
    if chance.filters:
        fill_normal(stream, episode.noise.reshape(-1))
        attacked = uniform(stream) < chance.attack_share
        onset_s = between(stream, chance.first_onset_s, chance.last_onset_s)
        episode.onset[0] = nearest(onset_s / chance.dt_s) if attacked else chance.horizon
    if chance.own_constants:
        row.proportional_gain = chance.proportional_gain * (1.0 + chance.gain_spread * between(stream, -1.0, 1.0))
        row.derivative_gain = chance.derivative_gain * (1.0 + chance.gain_spread * between(stream, -1.0, 1.0))
        row.disturbance_mps2 = between(stream, chance.least_disturbance_mps2, chance.most_disturbance_mps2)
