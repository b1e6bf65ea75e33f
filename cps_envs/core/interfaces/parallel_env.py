"""Both roles of a game as a `pettingzoo.ParallelEnv`: a batch of one, stepped at the game's own rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gymnasium import spaces

from cps_envs.core.actions import ActionReader
from cps_envs.core.interfaces.agents_env import AgentsEnv, Infos
from cps_envs.core.interfaces.info import agent_info
from cps_envs.core.problem import Problem
from cps_envs.core.types import AGENTS, ROLES, SIGN, Array, FloatArray, Observation, Role


class RolesParallelEnv(AgentsEnv):
    """Attacker and defender, both played from outside.

    A step is one game step. Some roles decide less often. Between their decisions the last action holds, new ones are
    ignored, and the action mask allows only the neutral action.
    """

    def __init__(
        self,
        problem: Problem,
        *,
        preset: str = "paper",
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        super().__init__(problem, problem.name, {}, problem.config(preset, overrides), render_mode, max_cycles)
        self.possible_agents = [AGENTS[role] for role in ROLES]
        self.observation_spaces: dict[str, spaces.Space[Any]] = {
            AGENTS[role]: self.game.fields[role].space() for role in ROLES
        }
        self.action_spaces = {AGENTS[role]: self.game.action_space[role] for role in ROLES}
        self._readers = {role: ActionReader(self.game.action_space[role]) for role in ROLES}
        self._held: dict[Role, Array] = {}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space of an agent."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space of an agent."""
        return self.action_spaces[agent]

    def _interval(self) -> int:
        return 1

    def _moves(self, actions: dict[str, Any]) -> dict[Role, Array]:
        """The actions in force: new ones where a decision of the role is due, held ones otherwise."""
        checked = {role: self._readers[role].single(actions[agent]) for role, agent in AGENTS.items()}
        due = {role for role in ROLES if self.game.elapsed[0] % self.game.decision_interval[role] == 0}
        self._held = {role: checked[role] if role in due else self._held[role] for role in ROLES}
        return self._held

    def _rewards(self, payoff: FloatArray) -> Sequence[float]:
        return [SIGN[role] * float(payoff[0]) for role in ROLES]

    def _observations(self) -> dict[str, Observation]:
        return {AGENTS[role]: self.game.observe(role)[0] for role in ROLES}

    def _infos(self) -> Infos:
        return {AGENTS[role]: agent_info(self.game, role) for role in ROLES}
