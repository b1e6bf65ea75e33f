"""The game as functions of one environment, see `core.policies.inside`."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.rogue.actions import read_choices, read_levels
from cps_envs.rogue.moves import step
from cps_envs.rogue.observation import observe_attacker, observe_defender
from cps_envs.rogue.start import Builds, Where, start_episodes
from cps_envs.rogue.state import State


class Shown(NamedTuple):
    """How a role's observations are encoded, see `core.declare.fields.Fields`."""

    offsets: Array  # (1,)
    scale: FloatArray  # (2, size)


class Held(NamedTuple):
    """What resets and steps take."""

    state: State
    drawn: Array  # (B,) records of `state.Drawn`
    scores: Array  # (B,) records of `payoff.Metrics`
    rules: Array  # (1,) records of `state.Rules`
    chances: Array  # (1,) records of `start.Chances`
    ranges: Array  # (2,) records of `start.Uniform`
    builds: Builds
    places: Where
    halves: IntArray  # (B,)
    leader_mps: FloatArray  # (K,)
    limits_mps2: FloatArray  # (2,) see `actions.command_limits`
    orders: IntArray  # (B, k, 2) that the defender has given last
    accelerations: FloatArray  # (B, k) m/s2
    attacker: Shown
    defender: Shown


@inlined
def reset(held: Held, streams: Array, envs: BoolArray) -> None:
    """Draw an episode and begin it."""
    given = (held.chances, held.ranges, held.builds, held.rules, held.places, held.halves, held.leader_mps)
    start_episodes(held.state, held.drawn, held.scores, streams, envs, *given)


@inlined
def advance(held: Held, attack: FloatArray, defense: IntArray, envs: BoolArray, payoff: FloatArray) -> None:
    """Take a step; the defender chooses controllers."""
    read_choices(defense, (held.limits_mps2[0], held.limits_mps2[1]), held.orders, held.accelerations)
    drive(held, attack, envs, payoff)


@inlined
def advance_commanded(held: Held, attack: FloatArray, defense: FloatArray, envs: BoolArray, payoff: FloatArray) -> None:
    """Take a step; the defender commands accelerations."""
    read_levels(defense, (held.limits_mps2[0], held.limits_mps2[1]), held.accelerations)
    drive(held, attack, envs, payoff)


@inlined
def drive(held: Held, attack: FloatArray, envs: BoolArray, payoff: FloatArray) -> None:
    """Take a step under the orders."""
    moves = (attack, held.orders, held.accelerations)
    step(held.state, held.drawn, held.rules, held.leader_mps, moves, envs, 1, held.scores, payoff)


@inlined
def show_attacker(held: Held, observation: Observation) -> None:
    """Fill (1, n)."""
    at = held.attacker
    observe_attacker(held.state, held.drawn, held.rules, at.offsets, at.scale, observation)


@inlined
def show_defender(held: Held, observation: Observation) -> None:
    """Fill (1, n)."""
    at = held.defender
    observe_defender(held.state, held.drawn, held.rules, at.offsets, at.scale, observation)
