"""A role split into agents that each see their own part: the decentralised form of a defence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.fields import Fields
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation


class Team(ABC):
    """A agents that together play one role of a game, in B environments; all have the same fields and actions."""

    agents: tuple[str, ...]  # A names
    fields: Fields  # of one agent's own observation
    action_space: spaces.Space[Any]  # of one agent

    @abstractmethod
    def observe(self) -> Observation:
        """Encoded observations (B, A, fields.size)."""

    def action_masks(self) -> BoolArray | None:
        """Legal actions (B, A, k), a fresh array; None where all are legal."""
        return None

    @abstractmethod
    def join(self, actions: Array) -> Array:
        """The role's action (B, ...) from the agents' actions (B, A, ...)."""

    def privileged(self) -> Observation:
        """`Game.privileged` for each agent, (B, A, p): for its own value function, in training only."""
        return np.zeros((*self.observe().shape[:2], 0), np.float32)

    @abstractmethod
    def rewards(self, payoff: FloatArray) -> FloatArray:
        """The agents' rewards (B, A) of the last step, given the attacker's payoff (B,) in it."""
