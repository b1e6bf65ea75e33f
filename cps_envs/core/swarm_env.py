"""One role of a game as a team in a `pettingzoo.ParallelEnv`: one agent per vehicle, say, against a fixed opponent."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from cps_envs.core.actions import ActionReader
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.parallel_env import Result
from cps_envs.core.problem import Problem
from cps_envs.core.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.types import Array, Observation, Role, other


class SwarmEnv(ParallelEnv[str, Observation, Any]):
    """The agents of a team; the other role is played from inside by `opponent`. A step is one decision of the team."""

    def __init__(
        self,
        problem: Problem,
        role: Role,
        *,
        preset: str = "paper",
        opponent: PolicyReference | None = None,
        render_mode: str | None = None,
        **overrides: Any,
    ) -> None:
        check_render_mode(render_mode)
        self.problem, self.role, self.render_mode = problem, role, render_mode
        self.metadata = {
            "name": f"{problem.name}_swarm_v{problem.version}",
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
            "is_parallelizable": True,
        }
        self.config = problem.config(preset, overrides)
        rival = other(role)
        self.opponent = problem.opponents[preset][rival] if opponent is None else opponent
        self._match = problem.match(self.config, 1, {rival: self.opponent})
        self.game = self._match.game
        self.team = self.game.team(role)
        self.possible_agents = list(self.team.agents)
        self.agents: list[str] = []
        self._space = self.team.fields.space()
        self._reader = ActionReader(self.team.action_space)
        self._generator: np.random.Generator | None = None
        self._lane = np.ones(1, np.bool_)
        self._renderer = Renderer(problem, self.game)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space, the same for every agent."""
        return self._space

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space, the same for every agent."""
        return self.team.action_space

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; without a seed the generator goes on."""
        if seed is not None or self._generator is None:
            self._generator = seeding.np_random(seed)[0]
        self._match.reset(self._lane, [self._generator])
        self.agents = self.possible_agents[:]
        if self.render_mode == "human":
            self._renderer.show()
        return self._observations(), self._infos()

    def step(self, actions: dict[str, Any]) -> Result:
        """Advance by one decision of the team.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: an agent's action is missing, has a wrong shape, is not finite or lies outside its space.
        """
        if not self.agents:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        interval = self.game.decision_interval[self.role]
        payoff = self._match.step({self.role: self._joined(actions)}, self._lane, interval)
        terminated = bool(self.game.terminated[0])
        truncated = not terminated and bool(self.game.elapsed[0] >= self.game.horizon)
        if self.render_mode == "human":
            self._renderer.show()
        rewards = dict(zip(self.agents, self.team.rewards(payoff)[0].tolist(), strict=True))
        ends = (dict.fromkeys(self.agents, terminated), dict.fromkeys(self.agents, truncated))
        result = (self._observations(), rewards, *ends, self._infos())
        if terminated or truncated:
            self.agents = []
        return result

    def render(self) -> Array | None:
        """A frame, uint8 (H, W, 3), in mode `rgb_array`; None otherwise."""
        return self._renderer.render(self.render_mode)

    def close(self) -> None:
        """Close the window, if one is open."""
        self._renderer.close()

    def _joined(self, actions: dict[str, Any]) -> Array:
        missing = [agent for agent in self.possible_agents if agent not in actions]
        if missing:
            raise ValueError(f"the actions of {', '.join(missing[:5])} are missing ({len(missing)} agents)")
        read = [self._reader.single(actions[agent]) for agent in self.possible_agents]
        return self.team.join(np.concatenate(read)[np.newaxis])

    def _observations(self) -> dict[str, Observation]:
        return dict(zip(self.possible_agents, map(np.copy, self.team.observe()[0]), strict=True))

    def _infos(self) -> dict[str, dict[str, Any]]:
        metrics = self.game.lane_metrics(0)
        infos: dict[str, dict[str, Any]] = {agent: dict(metrics) for agent in self.possible_agents}
        masks = self.team.action_masks()
        if masks is not None:
            for agent, mask in zip(self.possible_agents, masks[0].astype(np.int8), strict=True):
                infos[agent]["action_mask"] = mask.copy()
        return infos
