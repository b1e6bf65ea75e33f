"""The policies of a role that take one action: what a learner should beat."""

from __future__ import annotations

from itertools import product

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.policy import RoleSpec

MOST_CONSTANTS = 81  # of an adapter; above that they are too many to play


def constants_of(spec: RoleSpec, adapter: str, most: int = MOST_CONSTANTS) -> list[str]:
    """A reference to each constant action of an adapter, if at `most` so many; of a continuous one to the neutral."""
    bound = adapter_of(spec, adapter)
    choices = choices_of(bound.action_space)
    if not choices:
        return [f"always?adapter={adapter}&action={bound.neutral_action.tolist()}".replace(" ", "")]
    if np.prod(choices) > most:
        return []
    actions = [list(each) if bound.action_space.shape else each[0] for each in product(*map(range, choices))]
    return [f"always?adapter={adapter}&action={action}".replace(" ", "") for action in actions]


def native_constants(spec: RoleSpec) -> list[str]:
    """A reference to each of the role's own constant actions, if these are single numbers and few."""
    return constants_of(spec, NATIVE) if isinstance(spec.action_space, spaces.Discrete) else []
