"""What only the simulator knows of a role that is a team of agents; what they see and do is an adapter's."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from cps_envs.core.errors import ConfigurationError
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


def shared_alike(payoff: FloatArray, num_agents: int) -> FloatArray:
    """Minus the payoff (B,) in equal parts (B, A): what a defending team pays whose payoff has no owner."""
    return np.repeat(-payoff[:, np.newaxis] / num_agents, num_agents, axis=1)


class Grouped(Team):
    """Groups of equally many neighbours of a team, each as one agent, such as the platoons of vehicles.

    An agent is paid what its group is paid, and is told the mean of what its members are.

    Raises:
        ConfigurationError: the team cannot be divided into so many groups.
    """

    def __init__(self, team: Team, agents: tuple[str, ...]) -> None:
        if len(team.agents) % len(agents) > 0:
            raise ConfigurationError(f"{len(team.agents)} agents cannot be divided into {len(agents)} groups")
        self._team, self.agents = team, agents

    def observe(self) -> Observation:
        """The members' own sensors (B, members, m)."""
        return self._team.observe()

    def privileged(self) -> Observation:
        """(B, A, p)."""
        members = self._team.privileged()
        told: Observation = members.reshape(len(members), len(self.agents), -1, members.shape[2]).mean(axis=2)
        return told

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, A) of the last step."""
        members = self._team.rewards(payoff)
        together: FloatArray = members.reshape(len(members), len(self.agents), -1).sum(axis=2)
        return together


def grouped(team: Team, agents: tuple[str, ...]) -> Team:
    """The team, or groups of its members, so that it has as many agents as are named."""
    return team if len(team.agents) == len(agents) else Grouped(team, agents)
