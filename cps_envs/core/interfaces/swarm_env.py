"""One role of a game as a team in a `pettingzoo.ParallelEnv`: one agent per vehicle, say, against a fixed opponent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.actions import ActionReader
from cps_envs.core.interfaces.agents_env import AgentsEnv, Infos
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.problem import Problem
from cps_envs.core.types import Array, FloatArray, Observation, Role, other


class SwarmEnv(AgentsEnv):
    """The agents of a team; the other role is played from inside by `opponent`. A step is one decision of the team."""

    def __init__(
        self,
        problem: Problem,
        role: Role,
        *,
        preset: str = "paper",
        opponent: PolicyReference | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        config, rival = problem.config(preset, overrides), other(role)
        self.role = role
        self.opponent = problem.opponents[preset][rival] if opponent is None else opponent
        super().__init__(problem, f"{problem.name}_swarm", {rival: self.opponent}, config, render_mode, max_cycles)
        self.team = self.game.team(role)
        if not hasattr(self.team, "fields"):
            raise TypeError(f"the team of {problem.name!r} plays through an adapter and has no form of its own")
        self.possible_agents = list(self.team.agents)
        self._space = self.team.fields.space()
        self._reader = ActionReader(self.team.action_space)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space, the same for every agent."""
        return self._space

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space, the same for every agent."""
        return self.team.action_space

    def _interval(self) -> int:
        return self.game.decision_interval[self.role]

    def _moves(self, actions: dict[str, Any]) -> dict[Role, Array]:
        read = [self._reader.single(actions[agent]) for agent in self.possible_agents]
        return {self.role: self.team.join(np.concatenate(read)[np.newaxis])}

    def _rewards(self, payoff: FloatArray) -> Sequence[float]:
        rewards: list[float] = self.team.rewards(payoff)[0].tolist()
        return rewards

    def _observations(self) -> dict[str, Observation]:
        return dict(zip(self.possible_agents, map(np.copy, self.team.observe()[0]), strict=True))

    def _infos(self) -> Infos:
        metrics = self.game.episode_metrics(0)
        infos: Infos = {agent: dict(metrics) for agent in self.possible_agents}
        masks = self.team.action_masks()
        if masks is not None:
            for agent, mask in zip(self.possible_agents, masks[0].astype(np.int8), strict=True):
                infos[agent]["action_mask"] = mask.copy()
        return infos
