"""Whether a trained policy is one of a role, and what it has to say there."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from cps_agents.zoo.card import Card
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.registration import PROBLEMS, find_problem


def check_role(card: Card, spec: RoleSpec) -> None:
    """Check that a card is of this role.

    Raises:
        ConfigurationError: it is of another problem, role or version.
    """
    problem = find_problem(card.problem).name if ":" in card.problem else card.problem
    if (problem, card.role) != (spec.problem, spec.role):
        raise ConfigurationError(
            f"{card.name} was trained as {card.role} of {card.problem}, not as {spec.role} of {spec.problem}"
        )
    known = PROBLEMS.get(spec.problem)
    if known is not None and known.version != card.version:
        raise ConfigurationError(
            f"{card.name} was trained for version {card.version} of {card.problem}; this is {known.version}: train it "
            "again"
        )


def count_actions(space: spaces.Space[Any]) -> tuple[int, ...]:
    """Choices of each discrete entry, or (k,) for k continuous ones."""
    return choices_of(space) or (int(np.prod(space.shape or ())),)
