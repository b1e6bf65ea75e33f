"""What the PettingZoo interfaces share: one environment of a match, stepped under the actions of several agents."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from cps_envs.core.actions import SHOWN
from cps_envs.core.errors import shown
from cps_envs.core.interfaces.options import check_count, check_options
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.problem import Problem
from cps_envs.core.types import Array, FloatArray, Observation, Role

Infos = dict[str, dict[str, Any]]
Result = tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], Infos]


class AgentsEnv(ParallelEnv[str, Observation, Any]):
    """Base of the parallel environments. A subclass says who the agents are, and what they see, do and are paid."""

    possible_agents: list[str]

    def __init__(
        self,
        problem: Problem,
        name: str,
        players: Mapping[Role, PolicyReference],
        config: Any,
        render_mode: str | None,
        max_cycles: int | None = None,
    ) -> None:
        check_render_mode(render_mode)
        self._most = None if max_cycles is None else check_count("max_cycles", max_cycles)
        self._cycles = 0
        self.problem, self.config, self.render_mode = problem, config, render_mode
        self.metadata = {
            "name": f"{name}_v{problem.version}",
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
            "is_parallelizable": True,
        }
        self._match = problem.match(config, 1, players)
        self.game = self._match.game
        self.agents: list[str] = []
        self._generator: np.random.Generator | None = None
        self._envs = np.ones(1, np.bool_)
        self._renderer = Renderer(problem, self.game)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], Infos]:
        """Start an episode. Without a seed the generator continues."""
        if seed is not None or self._generator is None:
            self._generator = seeding.np_random(seed)[0]
        check_options(options)
        self._match.reset(self._envs, [self._generator])
        self.agents, self._cycles = self.possible_agents[:], 0
        if self.render_mode == "human":
            self._renderer.show()
        return self._observations(), self._infos()

    def step(self, actions: dict[str, Any]) -> Result:
        """Advance by one decision of the agents.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: an agent's action is missing, has a wrong shape, is not finite or lies outside its space.
        """
        if not self.agents:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        self._check_agents(actions)
        payoff = self._match.step(self._moves(actions), self._envs, self._interval())
        terminated = bool(self.game.terminated[0] or self.game.elapsed[0] >= self.game.horizon)
        self._cycles += 1
        truncated = not terminated and self._cycles == self._most
        if self.render_mode == "human":
            self._renderer.show()
        rewards = dict(zip(self.agents, self._rewards(payoff), strict=True))
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

    def _check_agents(self, actions: dict[str, Any]) -> None:
        if not isinstance(actions, Mapping):
            raise ValueError(f"actions = {shown(actions, SHOWN)} must be a dictionary with an action for each agent")
        missing = [agent for agent in self.possible_agents if agent not in actions]
        if missing:
            some = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
            raise ValueError(f"each agent has to act, but {len(missing)} actions are missing: {some}")

    @abstractmethod
    def _interval(self) -> int:
        """Game steps in a step of this environment."""

    @abstractmethod
    def _moves(self, actions: dict[str, Any]) -> dict[Role, Array]:
        """The roles' actions (1, ...) from those of the agents."""

    @abstractmethod
    def _rewards(self, payoff: FloatArray) -> Sequence[float]:
        """What the agents get, in order, when the attacker was paid `payoff` (1,)."""

    @abstractmethod
    def _observations(self) -> dict[str, Observation]: ...

    @abstractmethod
    def _infos(self) -> Infos: ...
