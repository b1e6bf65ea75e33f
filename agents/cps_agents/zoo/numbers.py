"""A trained policy that is no network: the numbers of a family of policies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_agents.machine import versions
from cps_agents.zoo.card import Card
from cps_agents.zoo.wired import check_role, count_actions
from cps_baselines.arena import Venue
from cps_baselines.family import find_family
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.types import Array, FloatArray, Role
from cps_envs.registration import find_problem

TENSOR = "numbers"
MOST = 1e6  # size of a number in a file; no search comes near


@dataclass(frozen=True)
class NamedNumbers:
    """What a search has found, (k,), in the order of the card's names."""

    values: FloatArray

    def tensors(self) -> dict[str, Array]:
        """The array by its name, for a file."""
        return {TENSOR: np.ascontiguousarray(self.values)}


def numbers_of(tensors: Mapping[str, Array], count: int) -> NamedNumbers:
    """The numbers of a file's arrays.

    Raises:
        ValueError: there are not `count` of them, or one is not finite or far too large.
    """
    if set(tensors) != {TENSOR}:
        raise ValueError(f"it should hold one array, {TENSOR!r}, and has {sorted(tensors)}")
    values = tensors[TENSOR]
    if values.dtype != np.float64 or values.shape != (count,):
        raise ValueError(f"it has {values.dtype} numbers of shape {values.shape}, the card names {count}")
    if not np.all(np.abs(values) <= MOST):
        raise ValueError("a number is not finite, or far too large")
    return NamedNumbers(values)


def card_of_numbers(venue: Venue, role: Role, **known: Any) -> Card:
    """The card of numbers that play a role in a venue; `known` is what that does not tell."""
    problem = find_problem(venue.problem)
    spec = problem.game(venue.config, 1).spec(role)
    return Card(
        problem=venue.problem,
        version=problem.version,
        role=role,
        preset=venue.preset,
        overrides=dict(venue.overrides),
        activation="",
        decentralised=False,
        hold=1,
        observation_size=spec.fields.size,
        actions=count_actions(spec.action_space),
        versions=versions(),
        **known,
    )


def member(spec: RoleSpec, card: Card, numbers: NamedNumbers) -> Policy:
    """The policy of a card's family with these numbers.

    Raises:
        ConfigurationError: it is of another role or version, or the family has other numbers by now.
        UnknownNameError: there is no such family.
        UntrustedCodeError: the card names code that the user has not agreed to run.
    """
    check_role(card, spec)
    family = find_family(card.family)
    if (family.problem, family.role, family.names) != (card.problem, card.role, card.numbers):
        raise ConfigurationError(f"{card.name} has other numbers than the family {card.family} has now: train it again")
    return family.build(spec, numbers.values[np.newaxis])
