"""What only the simulator knows of a role that is a team of agents; what they see and do is an adapter's."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from cps_envs.core.types import FloatArray, Observation


class Team(ABC):
    """A agents that together play one role of a game, in B environments."""

    agents: tuple[str, ...]  # A names

    @abstractmethod
    def rewards(self, payoff: FloatArray) -> FloatArray:
        """The agents' rewards (B, A) of the last step, given the attacker's payoff (B,) in it."""

    def observe(self) -> Observation:
        """What each agent's own sensors show, (B, A, m), for adapters that are `local`.

        Raises:
            TypeError: the agents have no sensors of their own.
        """
        raise TypeError(f"{type(self).__name__} has no sensors of its own beside what the role observes")

    def privileged(self) -> Observation:
        """`Game.privileged` for each agent, (B, A, p): for its own value function, in training only."""
        return np.zeros((0, len(self.agents), 0), np.float32)
