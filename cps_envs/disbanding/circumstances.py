"""What else is drawn for an episode: radio, the attacker's means, drivers who brake, the noise of actuators.

Only elements that a configuration uses draw anything, and they draw after `start.draw`: one that is left out shifts no
other draw.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_envs.core.config import Range, bounds
from cps_envs.core.types import Array, BoolArray, IntArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.start import draw_whole, whole_steps
from cps_envs.disbanding.state import State

WORDS = 4  # of a stream


def draw_circumstances(
    config: DisbandingConfig,
    envs: BoolArray,
    generators: Sequence[np.random.Generator],
    constants: Array,
    budget: IntArray,
    state: State,
) -> None:
    """Draw them for the marked environments (B,), whose vehicles are placed; a quiet episode has the budget 0."""
    dt_s = config.dynamics.dt_s
    for b in np.flatnonzero(envs).tolist():
        generator = generators[b]
        quiet = config.quiet_share > 0 and generator.random() < config.quiet_share
        budget[b] = 0 if quiet else budget[b]
        state.opening_s[b] = draw_whole(config.earliest_attack_s, generator)
        jam_s = draw_whole(config.jam_budget_s, generator)
        state.jam_steps[b] = 0 if quiet else round(jam_s / dt_s)
        if config.is_relayed:
            constants["hop_steps"][b] = whole_steps(draw_number(config.hop_delay_s, generator), dt_s)
            constants["hop_loss"][b] = draw_number(config.hop_loss, generator)
        if config.member_delay_s > 0:
            _alert_members(config, generator, state.takeover_delay_s[b])
        if config.braking_share > 0:
            _let_brake(config, generator, state, b)
        if config.is_relayed or config.correction_noise_mps2 > 0:
            state.chance[b] = generator.integers(2**64, size=WORDS, dtype=np.uint64)
            state.chance[b, -1] |= np.uint64(1)  # the increment of a stream is odd


def draw_number(value: Range, generator: Any) -> float:
    """A number of a quantity; nothing is drawn where it is exact."""
    low, high = bounds(value)
    return float(generator.uniform(low, high)) if low < high else float(low)


def _alert_members(config: DisbandingConfig, generator: Any, takeover_delay_s: Array) -> None:
    """Add to the delays (M,) the time in which an alert reaches each member of a platoon from the one attacked."""
    members = np.arange(config.vehicles_per_platoon)
    hops = np.abs(members + 1 - draw_whole(config.attacked_member, generator))
    takeover_delay_s += config.member_delay_s * np.tile(hops, config.max_platoons)


def _let_brake(config: DisbandingConfig, generator: Any, state: State, b: int) -> None:
    """Choose the drivers of episode `b` who brake when they take over, for how long and how hard."""
    chosen, lasting, hard = generator.random((3, config.max_vehicles))
    (shortest, longest), (softest, hardest) = bounds(config.braking_s), bounds(config.braking_mps2)
    brakes = chosen < config.braking_share
    state.braking_s[b] = np.where(brakes, shortest + (longest - shortest) * lasting, 0.0)
    state.braking_mps2[b] = np.where(brakes, softest + (hardest - softest) * hard, 0.0)
