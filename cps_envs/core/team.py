"""A role split into agents that each see their own part: the decentralised form of a defence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError
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


class Grouped(Team):
    """Groups of equally many neighbours of a team, each as one agent, such as the platoons of vehicles.

    An agent is paid what its group is paid, and is told the mean of what its members are. It has no sensors and no
    actions of its own: it acts through an adapter.

    Raises:
        ConfigurationError: the team cannot be divided into so many groups.
    """

    def __init__(self, team: Team, agents: tuple[str, ...]) -> None:
        if len(team.agents) % len(agents) > 0:
            raise ConfigurationError(f"{len(team.agents)} agents cannot be divided into {len(agents)} groups")
        self._team, self.agents = team, agents

    def observe(self) -> Observation:
        """The members' own (B, members, size)."""
        return self._team.observe()

    def join(self, actions: Array) -> Array:
        """Not possible: the members act, not the groups.

        Raises:
            TypeError: always.
        """
        raise TypeError("groups of agents act through an adapter")

    def privileged(self) -> Observation:
        """(B, A, p)."""
        members = self._team.privileged()
        return members.reshape(len(members), len(self.agents), -1, members.shape[2]).mean(axis=2)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, A) of the last step."""
        members = self._team.rewards(payoff)
        return members.reshape(len(members), len(self.agents), -1).sum(axis=2)


def grouped(team: Team, agents: tuple[str, ...]) -> Team:
    """The team, or groups of its members, so that it has as many agents as are named."""
    return team if len(team.agents) == len(agents) else Grouped(team, agents)
