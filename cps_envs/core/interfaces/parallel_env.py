"""Both roles of a game as a `pettingzoo.ParallelEnv`: a batch of one, stepped at the game's own rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_envs.core.declare.training import NATIVE
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_env import AgentsEnv
from cps_envs.core.types import ROLES, Role


class RolesParallelEnv(AgentsEnv):
    """Attacker and defender, both played from outside.

    A step is one game step, or `frame_skip` of them. Some roles decide less often. Between their decisions the last
    action holds, new ones are ignored, and the action mask allows only the neutral action. `adapters` names what the
    roles are played through, such as `{"attacker": "effort", "defender": "vehicle"}`; a role that is left out is played
    as it is. A team's agents are named after their role, such as `defender_vehicle_1`.
    """

    def __init__(
        self,
        problem: Problem,
        *,
        preset: str | None = None,
        adapters: Mapping[Role, str] | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        frame_skip: int = 1,
        **overrides: Any,
    ) -> None:
        chosen = {role: (adapters or {}).get(role, NATIVE) for role in ROLES}
        config = problem.config(preset, overrides)
        options: dict[str, Any] = {"render_mode": render_mode, "max_cycles": max_cycles, "frame_skip": frame_skip}
        super().__init__(problem, problem.name, chosen, {}, config, **options)
