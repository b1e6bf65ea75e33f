"""One role as a team of agents, one per vehicle, say, against a fixed opponent: one episode or a batch of them."""

from __future__ import annotations

from typing import Any

from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_batch import team_of
from cps_envs.core.interfaces.agents_env import AgentsEnv
from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.types import Role


class SwarmEnv(AgentsEnv):
    """The agents of a team; the other role is played from inside by `opponent`. A step is one decision of the team.

    `adapter` says what the agents are, see, and do; by default the one that `Problem.swarm` names.
    """

    def __init__(self, problem: Problem, role: Role, *, adapter: str | None = None, **options: Any) -> None:
        """Make it.

        Raises:
            TypeError: the role has no team.
        """
        self.role = role
        super().__init__(problem, f"{problem.name}_swarm", team_of(problem, role, adapter), **options)


class SwarmVectorEnv(AgentsVectorEnv):
    """`SwarmEnv` for `num_envs` episodes at once."""

    def __init__(
        self, problem: Problem, role: Role, num_envs: int, *, adapter: str | None = None, **options: Any
    ) -> None:
        """Make it.

        Raises:
            TypeError: the role has no team.
        """
        self.role = role
        super().__init__(problem, f"{problem.name}_swarm", team_of(problem, role, adapter), num_envs, **options)
