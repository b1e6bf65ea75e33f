"""Both roles of a game as a `pettingzoo.ParallelEnv`: the batch with a single lane, stepped at the game's own rate."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from cps_envs.core.actions import ActionReader
from cps_envs.core.info import lane_info
from cps_envs.core.problem import Problem
from cps_envs.core.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.types import AGENTS, ROLES, SIGN, Array, Observation, Role

Result = tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]


class DuelEnv(ParallelEnv[str, Observation, Any]):
    """Attacker and defender, both played from outside.

    A step is one game step. A role whose decisions are due less often has its action ignored in between: the last one
    holds, and its action mask allows only the neutral action.
    """

    def __init__(
        self, problem: Problem, *, preset: str = "paper", render_mode: str | None = None, **overrides: Any
    ) -> None:
        check_render_mode(render_mode)
        self.problem, self.render_mode = problem, render_mode
        self.metadata = {
            "name": f"{problem.name}_v{problem.version}",
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
            "is_parallelizable": True,
        }
        self.config = problem.config(preset, overrides)
        self._match = problem.match(self.config, 1, {})
        self.game = self._match.game
        self.possible_agents = [AGENTS[role] for role in ROLES]
        self.agents: list[str] = []
        self.observation_spaces: dict[str, spaces.Space[Any]] = {
            AGENTS[role]: self.game.fields[role].space() for role in ROLES
        }
        self.action_spaces = {AGENTS[role]: self.game.action_space[role] for role in ROLES}
        self._readers = {role: ActionReader(self.game.action_space[role]) for role in ROLES}
        self._held: dict[Role, Array] = {}
        self._generator: np.random.Generator | None = None
        self._lane = np.ones(1, np.bool_)
        self._renderer = Renderer(problem, self.game)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space of an agent."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space of an agent."""
        return self.action_spaces[agent]

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
        """Advance by one game step under the actions of both agents.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: an agent's action is missing, has a wrong shape, is not finite or lies outside its space.
        """
        if not self.agents:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        payoff = float(self._match.step(self._decided(actions), self._lane, 1)[0])
        terminated = bool(self.game.terminated[0])
        truncated = not terminated and bool(self.game.elapsed[0] >= self.game.horizon)
        if self.render_mode == "human":
            self._renderer.show()
        rewards = {AGENTS[role]: SIGN[role] * payoff for role in ROLES}
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

    def _decided(self, actions: dict[str, Any]) -> dict[Role, Array]:
        """The actions in force: new ones where a decision of the role is due, held ones otherwise."""
        checked = {}
        for role, agent in AGENTS.items():
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; got actions of {sorted(actions)}")
            checked[role] = self._readers[role].single(actions[agent])
        due = {role for role in ROLES if self.game.elapsed[0] % self.game.decision_interval[role] == 0}
        self._held = {role: checked[role] if role in due else self._held[role] for role in ROLES}
        return self._held

    def _observations(self) -> dict[str, Observation]:
        return {AGENTS[role]: self.game.observe(role)[0] for role in ROLES}

    def _infos(self) -> dict[str, dict[str, Any]]:
        return {AGENTS[role]: lane_info(self.game, role) for role in ROLES}
