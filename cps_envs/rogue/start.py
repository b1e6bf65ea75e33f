"""The start of an episode: who is seized, when the attack begins, and the perturbed steady state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, fill, inlined, kernel, nearest, pack, room, unpack, view
from cps_envs.core.compute.streams import draw_word, fill_uniform, uniform, whole
from cps_envs.core.declare.bodies import names_each, spans
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.places import Places
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import OF_VEHICLES, RogueConfig
from cps_envs.rogue.payoff import measure
from cps_envs.rogue.state import NEVER, Drawn, Rules, State, of_vehicle, platoon


class Uniform(NamedTuple):
    """The quantities that an episode draws uniformly, in the order of the draws."""

    drive_mps2: float
    power_ratio: float
    drag_per_s: float
    reference_speed_mps: float
    onset_s: float


class Chances(NamedTuple):
    """What else is drawn: who is seized, of how many vehicles, and whether there is an attack."""

    first_attacker: int
    last_attacker: int
    leader_too: bool  # whether the leader may be
    fewest_vehicles: int
    most_vehicles: int
    attack_share: float


def chances_of(config: RogueConfig) -> Array:
    """The chances of a configuration as records (1,)."""
    first, last = config.seat_range
    last = first if config.attacker_indices else last
    leader_too = config.leader_may_be_seized
    fewest, most = bounds(config.num_vehicles)
    return pack(Chances(first, last, leader_too, int(fewest), int(most), config.attack_share))


def ranges_of(config: RogueConfig) -> Array:
    """The lowest values of `Uniform` and the widths of their ranges, (2,) of Uniform."""
    ends = [bounds(getattr(config, name)) for name in Uniform._fields]
    low = pack(Uniform(*(float(low) for low, _ in ends)))
    width = pack(Uniform(*(float(high) - float(low) for low, high in ends)))
    return np.concatenate([low, width])


class Builds(NamedTuple):
    """Drive, drag, length and gains of the vehicles, in the order of `config.OF_VEHICLES`; m of them differ."""

    low: FloatArray  # (5, m)
    width: FloatArray  # (5, m) of the intervals that are drawn from; nothing is drawn where it is 0
    each: BoolArray  # (5,) whether every vehicle has its own; else all have the first
    further: IntArray  # (k - 1,) the other vehicles of k that attack together, 0 = rear


def builds_of(config: RogueConfig) -> Builds:
    """How the vehicles of a configuration may differ; a common drive or drag is drawn with `Uniform`."""
    values, shape = [getattr(config, name) for name in OF_VEHICLES], (len(OF_VEHICLES), config.num_bodies)
    low, width = np.zeros(shape), np.zeros(shape)
    for q, value in enumerate(values):
        ends = spans(value)
        low[q], width[q] = ends[0], ends[1] - ends[0]
    further = np.array(config.attacker_indices[1:], np.int64) - 1
    return Builds(low, width, np.array([names_each(value) for value in values]), further)


class Where(NamedTuple):
    """The arrays of `core.declare.places.Places`."""

    first: IntArray  # (2, m)
    counts: IntArray  # (2,)


@kernel
def start_episodes(
    state: State,
    drawn: Array,
    scores: Array,
    streams: Array,
    envs: BoolArray,
    chances: Array,
    ranges: Array,
    builds: Builds,
    rules: Array,
    places: Places | Where,
    halves: IntArray,
    leader_mps: FloatArray,
) -> None:
    """Put the marked environments (B,) at time 0 in steady state, perturbed, with everything counted at zero.

    What the configuration leaves exact is drawn from the streams (B, 6), too, to keep the order of draws. Episodes that
    follow a series (K,) begin at one of the `places` of their half of the time (B,).
    """
    r, chance = unpack(Rules, rules, 0), unpack(Chances, chances, 0)
    low, width = unpack(Uniform, ranges, 0), unpack(Uniform, ranges, 1)
    most = state.position.shape[1]
    spacing, speed = room(most), room(most)
    for b in range(envs.size):
        if envs[b]:
            stream, own, score = borrowed(streams)[b], drawn[b], scores[b]
            draw_platoon(stream, own, chance)
            share = draw_shares(stream)
            own.drive_mps2 = low.drive_mps2 + width.drive_mps2 * share.drive_mps2
            own.drag_per_s = low.drag_per_s + width.drag_per_s * share.drag_per_s
            own.reference_speed_mps = low.reference_speed_mps + width.reference_speed_mps * share.reference_speed_mps
            own.noise_seed = np.int64(draw_word(stream))
            fill_uniform(stream, borrowed(spacing))
            fill_uniform(stream, borrowed(speed))
            attacked = chance.attack_share >= 1.0 or uniform(stream) < chance.attack_share
            onset_step = nearest((low.onset_s + width.onset_s * share.onset_s) / r.dt_s)
            own.onset_step = onset_step if attacked else NEVER
            clear(view(state, b), score)
            episode = platoon(state, b, own.num_vehicles)
            build(stream, episode, own, builds)
            episode.rogue[own.attacker] = True
            for seat in builds.further:
                episode.rogue[seat] = True
            own.attacker_drive_mps2 = (low.power_ratio + width.power_ratio * share.power_ratio) * own.drive_mps2
            if r.cycles:
                episode.place[0] = places.first[halves[b], whole(stream, 0, places.counts[halves[b]])]
                own.reference_speed_mps = leader_mps[episode.place[0]]
            place(episode, borrowed(spacing), borrowed(speed), own.reference_speed_mps, r)
            own.reference_start_m = episode.position[-1]
            measure(episode, score, unpack(Drawn, drawn, b), r)


@inlined
def build(stream: Array, episode: State, drawn: Record, builds: Builds) -> None:
    """Draw the vehicles, whose common drive and drag are drawn already; note those of the seized one."""
    vehicles = (
        episode.drive_mps2,
        episode.drag_per_s,
        episode.length_m,
        episode.proportional_gain,
        episode.derivative_gain,
    )
    for q in range(len(vehicles)):
        common = drawn.drive_mps2 if q == 0 else drawn.drag_per_s
        if q > 1:
            common = builds.low[q, 0]
            if not builds.each[q] and builds.width[q, 0] > 0.0:
                common += builds.width[q, 0] * uniform(stream)
        for i in range(vehicles[q].size):
            value = common
            if builds.each[q]:
                value = builds.low[q, i]
                if builds.width[q, i] > 0.0:
                    value += builds.width[q, i] * uniform(stream)
            vehicles[q][i] = value
    drawn.drive_mps2 = of_vehicle(episode.drive_mps2, drawn.attacker)
    drawn.drag_per_s = of_vehicle(episode.drag_per_s, drawn.attacker)


@inlined
def draw_platoon(stream: Array, own: Record, chance: Chances) -> None:
    """Draw the number of vehicles, and who of them is seized."""
    own.num_vehicles = whole(stream, chance.fewest_vehicles, chance.most_vehicles + 1)
    foremost = own.num_vehicles - (not chance.leader_too)
    own.attacker = whole(stream, chance.first_attacker, min(chance.last_attacker, foremost) + 1) - 1


@inlined
def draw_shares(stream: Array) -> Uniform:
    """How far up its range each quantity is, in [0, 1)."""
    return Uniform(uniform(stream), uniform(stream), uniform(stream), uniform(stream), uniform(stream))


@inlined
def clear(episode: State, score: Record) -> None:
    """Forget the last episode."""
    for vehicles in (episode.position, episode.speed, episode.acceleration, episode.effort, episode.growth):
        fill(vehicles, 0.0)
    fill(episode.front_detector, 0.0)
    fill(episode.rear_detector, 0.0)
    fill(episode.damage, 0.0)
    for counts in (episode.alarm, episode.controller, episode.collisions, episode.step):
        fill(counts, 0)
    fill(episode.armed, True)
    fill(episode.held_effort, 0.0)
    fill(episode.rogue, False)
    score.formation_cost_s = 0.0
    score.first_collision_s = score.first_alarm_s = -1.0
    score.false_alarms = 0.0


@inlined
def place(episode: State, spacing: FloatArray, speed: FloatArray, reference_mps: float, r: Rules) -> None:
    """Positions and speeds; spacings and speeds lie within their spreads, the rear vehicle at 0."""
    first = end = 0.0
    for i in range(episode.position.size):
        end += r.separation_m + (-r.spacing_spread_m + 2.0 * r.spacing_spread_m * spacing[i])
        first = end if i == 0 else first
        episode.position[i] = end - first
        episode.speed[i] = max(0.0, reference_mps + (-r.speed_spread_mps + 2.0 * r.speed_spread_mps * speed[i]))
