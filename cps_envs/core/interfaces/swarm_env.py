"""One role as a team in a `pettingzoo.ParallelEnv`: one agent per vehicle, say, against a fixed opponent."""

from __future__ import annotations

from typing import Any

from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_env import AgentsEnv
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Role, other


class SwarmEnv(AgentsEnv):
    """The agents of a team; the other role is played from inside by `opponent`. A step is one decision of the team.

    `adapter` says what the agents are, see, and do; by default the one that `Problem.swarm` names.
    """

    def __init__(
        self,
        problem: Problem,
        role: Role,
        *,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        adapter: str | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        frame_skip: int = 1,
        **overrides: Any,
    ) -> None:
        """Make it.

        Raises:
            TypeError: the role has no team.
        """
        if adapter is None and role not in problem.swarm:
            raise TypeError(f"the {role} of {problem.name!r} has no decentralised form")
        config, rival = problem.config(preset, overrides), other(role)
        self.role = role
        self.opponent = problem.opponent(preset, rival) if opponent is None else opponent
        options: dict[str, Any] = {"render_mode": render_mode, "max_cycles": max_cycles, "frame_skip": frame_skip}
        chosen: dict[Role, str] = {role: adapter or problem.swarm[role]}
        super().__init__(problem, f"{problem.name}_swarm", chosen, {rival: self.opponent}, config, **options)
