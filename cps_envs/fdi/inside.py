"""The game as functions of one environment, see `core.policies.inside`."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.drawing import draw
from cps_envs.fdi.dynamics import begin, step
from cps_envs.fdi.filtered import observe_filtered
from cps_envs.fdi.observation import observe_attacker, observe_defender
from cps_envs.fdi.state import Batch


class Held(NamedTuple):
    """What resets and steps take."""

    batch: Batch
    openings: Array  # (T,) records of `payoff.Metrics`
    episodes: IntArray  # (B,)
    chances: Array  # (1,) records of `drawing.Chances`


@inlined
def reset(held: Held, streams: Array, envs: BoolArray) -> None:
    """Draw an episode and begin it."""
    draw(held.batch, streams, envs, held.chances)
    begin(held.batch, held.openings, held.episodes, envs)


@inlined
def reset_exact(held: Held, streams: Array, envs: BoolArray) -> None:
    """Begin an episode of which nothing is drawn."""
    begin(held.batch, held.openings, held.episodes, envs)


@inlined
def advance(held: Held, attack: IntArray, defense: IntArray, envs: BoolArray, payoff: FloatArray) -> None:
    """Take a step."""
    step(held.batch, attack, defense, envs, 1, payoff)


@inlined
def show_attacker(held: Held, observation: Observation) -> None:
    """Fill (1, n)."""
    observe_attacker(held.batch, observation)


@inlined
def show_defender(held: Held, observation: Observation) -> None:
    """Fill (1, n), of a defender without a filter."""
    observe_defender(held.batch, observation)


@inlined
def show_filtered(held: Held, observation: Observation) -> None:
    """Fill (1, n), of a defender with a filter."""
    observe_filtered(held.batch, observation)
