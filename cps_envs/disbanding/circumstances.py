"""What else is drawn for an episode: radio, the attacker's means, drivers who brake, the noise of actuators.

Only elements that a configuration uses draw anything, and they draw after `start.draw`: one that is left out shifts no
other draw.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, nearest, pack, unpack, view
from cps_envs.core.compute.streams import between, draw_word, uniform, whole
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, BoolArray, IntArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.state import State


class Circumstances(NamedTuple):
    """The intervals that an episode's circumstances are drawn from; nothing is drawn where an interval is exact."""

    earliest_opening_s: int
    latest_opening_s: int
    least_jam_s: int
    most_jam_s: int
    least_hop_s: float
    most_hop_s: float
    least_loss: float
    most_loss: float
    shortest_braking_s: float
    longest_braking_s: float
    softest_braking_mps2: float
    hardest_braking_mps2: float
    first_member: int
    last_member: int
    quiet_share: float
    member_delay_s: float
    least_braking_limit_mps2: float
    most_braking_limit_mps2: float
    least_jerk_limit_mps3: float
    most_jerk_limit_mps3: float
    least_gap_limit_m: float
    most_gap_limit_m: float
    least_reaction_s: float
    most_reaction_s: float
    braking_share: float
    dt_s: float
    relayed: bool
    noisy: bool  # whether actuators are


def circumstances_of(config: DisbandingConfig) -> Array:
    """The circumstances of a configuration as records (1,)."""
    whole = (config.earliest_attack_s, config.jam_budget_s)
    reals = (config.hop_delay_s, config.hop_loss, config.braking_s, config.braking_mps2)
    values: list[Any] = [end for value in (*whole, *reals, config.attacked_member) for end in bounds(value)]
    values += (config.quiet_share, config.member_delay_s)
    limits = (config.alarming_braking_mps2, config.alarming_jerk_mps3, config.alarming_gap_m, config.reaction_s)
    values += [end for value in limits for end in bounds(value)]
    values += [config.braking_share]
    values += (config.dynamics.dt_s, config.is_relayed, config.correction_noise_mps2 > 0)
    return pack(Circumstances(*values))


@kernel
def draw_circumstances(
    state: State, constants: Array, budget: IntArray, streams: Array, envs: BoolArray, circumstances: Array
) -> None:
    """Draw them for the marked environments (B,), whose vehicles are placed, from their streams (B, 6).

    A quiet episode has the budget 0.
    """
    c = unpack(Circumstances, circumstances, 0)
    for b in range(envs.size):
        if envs[b]:
            stream, episode, own = borrowed(streams)[b], view(state, b), constants[b]
            quiet = c.quiet_share > 0.0 and uniform(stream) < c.quiet_share
            budget[b] = 0 if quiet else budget[b]
            episode.opening_s[0] = whole(stream, c.earliest_opening_s, c.latest_opening_s + 1)
            jam_s = whole(stream, c.least_jam_s, c.most_jam_s + 1)
            episode.jam_steps[0] = 0 if quiet else nearest(jam_s / c.dt_s)
            if c.relayed:
                hop_s = unless_exact(stream, c.least_hop_s, c.most_hop_s)
                own.hop_steps = max(1, nearest(hop_s / c.dt_s))
                own.hop_loss = unless_exact(stream, c.least_loss, c.most_loss)
            if c.member_delay_s > 0.0:
                alert_members(episode, own, c, stream)
            if c.braking_share > 0.0:
                let_brake(episode, c, stream)
            if episode.jolted_until_s.size > 0:
                episode.attacked_member[0] = whole(stream, c.first_member, c.last_member + 1)
            if episode.reaction_s.size > 0:
                draw_drivers(episode, c, stream)
            if c.relayed or c.noisy:
                for i in range(episode.chance.size):
                    episode.chance[i] = draw_word(stream)
                episode.chance[-1] |= np.uint64(1)  # the increment of a stream is odd


@inlined
def unless_exact(stream: Array, low: float, high: float) -> float:
    """A number of an interval; nothing is drawn where it is exact."""
    return between(stream, low, high) if low < high else low


@inlined
def alert_members(episode: State, own: Record, c: Circumstances, stream: Array) -> None:
    """Add to the delays the time in which an alert reaches each member of a platoon from the one attacked."""
    attacked = whole(stream, c.first_member, c.last_member + 1)
    for q in range(episode.takeover_delay_s.size):
        hops = abs(q % own.vehicles_per_platoon + 1 - attacked)
        episode.takeover_delay_s[q] += c.member_delay_s * hops


@inlined
def draw_drivers(episode: State, c: Circumstances, stream: Array) -> None:
    """Draw what alarms each driver, and how long it takes them to take over; a limit of 0 alarms nobody."""
    for q in range(episode.reaction_s.size):
        braking = between(stream, c.least_braking_limit_mps2, c.most_braking_limit_mps2)
        episode.alarming_braking_mps2[q] = braking if braking > 0.0 else np.inf
        jerk = between(stream, c.least_jerk_limit_mps3, c.most_jerk_limit_mps3)
        episode.alarming_jerk_mps3[q] = jerk if jerk > 0.0 else np.inf
        gap = between(stream, c.least_gap_limit_m, c.most_gap_limit_m)
        episode.alarming_gap_m[q] = gap if gap > 0.0 else -np.inf
        episode.reaction_s[q] = between(stream, c.least_reaction_s, c.most_reaction_s)


@inlined
def let_brake(episode: State, c: Circumstances, stream: Array) -> None:
    """Choose the drivers who brake when they take over, for how long and how hard."""
    for q in range(episode.braking_s.size):
        episode.braking_mps2[q] = 1.0 if uniform(stream) < c.braking_share else 0.0
    for q in range(episode.braking_s.size):
        episode.braking_s[q] = episode.braking_mps2[q] * between(stream, c.shortest_braking_s, c.longest_braking_s)
    for q in range(episode.braking_s.size):
        episode.braking_mps2[q] *= between(stream, c.softest_braking_mps2, c.hardest_braking_mps2)
