"""Both roles of a game as agents: `pettingzoo.ParallelEnv`, or a batch of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_batch import both_of
from cps_envs.core.interfaces.agents_env import AgentsEnv
from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.types import Role


class RolesParallelEnv(AgentsEnv):
    """Attacker and defender, both played from outside.

    In the interface for learners, the default in preset `learning`, both are played through their usual adapters, a
    team by all its agents, and a step lasts until the first of them decides again. In the native one a step is one game
    step, or `frame_skip` of them; some roles decide less often, and between their decisions the last action holds and
    the action mask allows only the neutral action. `adapters` names what the roles are played through, such as
    `{"attacker": "effort", "defender": "vehicle"}`. A team's agents are named after their role, such as
    `defender_vehicle_1`.
    """

    def __init__(self, problem: Problem, *, adapters: Mapping[Role, str] | None = None, **options: Any) -> None:
        super().__init__(problem, problem.name, both_of(adapters), **options)


class RolesVectorEnv(AgentsVectorEnv):
    """`RolesParallelEnv` for `num_envs` episodes at once."""

    def __init__(
        self, problem: Problem, num_envs: int, *, adapters: Mapping[Role, str] | None = None, **options: Any
    ) -> None:
        super().__init__(problem, problem.name, both_of(adapters), num_envs, **options)
