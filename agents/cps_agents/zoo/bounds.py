"""Observations of one configuration as those of another: the same quantities, scaled to the other's bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_agents.zoo.card import Card
from cps_envs.core.fields import Fields
from cps_envs.core.policy import RoleSpec
from cps_envs.core.problem import Problem
from cps_envs.core.types import Array, FloatArray, Role
from cps_envs.registration import PROBLEMS


@dataclass(frozen=True)
class Rescaling:
    """Encoded entries times `gain` (n,) plus `shift` (n,), clipped to [-1, 1]."""

    gain: FloatArray
    shift: FloatArray

    def __call__(self, observation: Array) -> Array:
        """Observations (B, n) as the network's own configuration would have encoded them."""
        scaled: Array = np.clip(observation * self.gain + self.shift, -1.0, 1.0).astype(np.float32)
        return scaled


def rescaling(card: Card, spec: RoleSpec) -> Rescaling | None:
    """What brings a role's observations into the bounds a network was trained with; None where these are the same.

    Bounds follow the configuration: a budget is shown as a share of the largest one, time as a share of the duration.
    None, too, where the observations are different ones, which the policy refuses by their size.
    """
    if card.problem not in PROBLEMS:
        return None
    problem = PROBLEMS[card.problem]
    trained = _fields(problem, problem.config(card.preset, card.overrides), spec.role, card.decentralised)
    fields = _fields(problem, spec.config, spec.role, True) if card.decentralised else spec.fields
    if [(field.name, field.size) for field in trained] != [(field.name, field.size) for field in fields]:
        return None
    (low, high), (trained_low, trained_high) = _bounds(fields), _bounds(trained)
    if np.array_equal(low, trained_low) and np.array_equal(high, trained_high):
        return None
    gain = (high - low) / (trained_high - trained_low)
    shift = (high + low - trained_high - trained_low) / (trained_high - trained_low)
    return Rescaling(gain, shift)


def _fields(problem: Problem, config: Any, role: Role, decentralised: bool) -> Fields:
    """What the role, or one agent of its team, observes."""
    if not decentralised:
        return problem.fields[role](config)
    return problem.game(config, 1).spec(role).adapter(problem.swarm[role]).fields


def _bounds(fields: Fields) -> tuple[FloatArray, FloatArray]:
    low = np.concatenate([np.full(field.size, field.low) for field in fields])
    high = np.concatenate([np.full(field.size, field.high) for field in fields])
    return low, high
