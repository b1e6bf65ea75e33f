"""The start of an episode: who is seized, when the attack begins, and the perturbed steady state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.core.kernels import Record, fill, inlined, kernel, pack, record_type, unpack, view
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.payoff import measure
from cps_envs.rogue.state import NEVER, Drawn, Rules, State, platoon


class Uniform(NamedTuple):
    """What is drawn uniformly, in the order of the draws."""

    drive_mps2: float
    power_ratio: float
    drag_per_s: float
    reference_speed_mps: float
    onset_s: float


class Draws(NamedTuple):
    """Draws for K episodes that start; what the configuration leaves exact is drawn too, to keep the order of draws."""

    env: IntArray  # (K,) which environment
    attacker: IntArray  # (K,)
    num_vehicles: IntArray  # (K,)
    attacked: BoolArray  # (K,)
    noise_seed: IntArray  # (K,)
    share: Array  # (K,) of Uniform, in [0, 1)
    spacing: FloatArray  # (K, n) in [0, 1), how far each spacing is up its range
    speed: FloatArray  # (K, n) in [0, 1), the same of the speeds


def ranges_of(config: RogueConfig) -> Array:
    """The lowest values of `Uniform` and the widths of their ranges, (2,) of Uniform."""
    ends = [bounds(getattr(config, name)) for name in Uniform._fields]
    low = pack(Uniform(*(float(low) for low, _ in ends)))
    width = pack(Uniform(*(float(high) - float(low) for low, high in ends)))
    return np.concatenate([low, width])


def draw(config: RogueConfig, envs: IntArray, generators: Sequence[np.random.Generator]) -> Draws:
    """Draw an episode for each of the environments `envs` (K,) from its own of the B generators."""
    count, first, last = len(envs), *(int(end) for end in bounds(config.attacker_index))
    quantities = np.empty((count, len(Uniform._fields)))
    places = np.empty((2, count, config.max_vehicles))
    attackers, seeds = np.empty(count, np.int64), np.empty(count, np.uint64)
    vehicles, attacked = np.full(count, config.max_vehicles), np.ones(count, np.bool_)
    fewest = int(bounds(config.num_vehicles)[0])
    for k, b in enumerate(envs.tolist()):
        generator = generators[b]
        if fewest < config.max_vehicles:
            vehicles[k] = generator.integers(fewest, config.max_vehicles + 1)
        attackers[k] = generator.integers(first, min(last, vehicles[k] - 1) + 1) - 1
        generator.random(out=quantities[k])
        seeds[k] = generator.integers(0, 2**64, dtype=np.uint64)
        generator.random(out=places[0, k])
        generator.random(out=places[1, k])
        if config.attack_share < 1:
            attacked[k] = generator.random() < config.attack_share
    share = quantities.view(record_type(Uniform)).reshape(count)
    return Draws(envs, attackers, vehicles, attacked, seeds.view(np.int64), share, places[0], places[1])


@kernel
def start_episodes(state: State, drawn: Array, scores: Array, draws: Draws, ranges: Array, rules: Array) -> None:
    """Put the environments of the draws at time 0 in steady state, perturbed, with everything counted at zero."""
    r, low, width = unpack(Rules, rules, 0), unpack(Uniform, ranges, 0), unpack(Uniform, ranges, 1)
    for k in range(draws.env.size):
        b, share = draws.env[k], unpack(Uniform, draws.share, k)
        own = drawn[b]
        own.attacker, own.num_vehicles, own.noise_seed = draws.attacker[k], draws.num_vehicles[k], draws.noise_seed[k]
        own.drive_mps2 = low.drive_mps2 + width.drive_mps2 * share.drive_mps2
        own.attacker_drive_mps2 = (low.power_ratio + width.power_ratio * share.power_ratio) * own.drive_mps2
        own.drag_per_s = low.drag_per_s + width.drag_per_s * share.drag_per_s
        own.reference_speed_mps = low.reference_speed_mps + width.reference_speed_mps * share.reference_speed_mps
        onset_step = int(np.rint((low.onset_s + width.onset_s * share.onset_s) / r.dt_s))
        own.onset_step = onset_step if draws.attacked[k] else NEVER
        score = scores[b]
        clear(view(state, b), score)
        episode = platoon(state, b, own.num_vehicles)
        place(episode, draws.spacing[k], draws.speed[k], own.reference_speed_mps, r)
        own.reference_start_m = episode.position[-1]
        measure(episode, score, unpack(Drawn, drawn, b), r)


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
    episode.held_effort[0] = score.formation_cost_s = 0.0
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
        episode.speed[i] = reference_mps + (-r.speed_spread_mps + 2.0 * r.speed_spread_mps * speed[i])
