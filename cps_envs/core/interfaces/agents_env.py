"""What the PettingZoo interfaces share: one environment of a match, stepped under the actions of several agents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from cps_envs.core.declare.actions import SHOWN, ActionReader, choices_of
from cps_envs.core.errors import shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.options import check_count, check_options
from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import AGENTS, Array, FloatArray, Observation, Role, State

Infos = dict[str, dict[str, Any]]
Result = tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], Infos]


class AgentsEnv(ParallelEnv[str, Observation, Any]):
    """Roles that are played from outside, each through an adapter by one agent or a team.

    A step is `interval` game steps, `frame_skip` times. Some roles decide less often. Between their decisions the last
    action holds, and new ones are ignored.
    """

    possible_agents: list[str]

    def __init__(
        self,
        problem: Problem,
        name: str,
        adapters: Mapping[Role, str],
        players: Mapping[Role, PolicyReference],
        config: Any,
        *,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        frame_skip: int = 1,
    ) -> None:
        """`adapters` names those of the roles that are played from outside; `players` plays the other role, if any."""
        check_render_mode(render_mode)
        self._most = None if max_cycles is None else check_count("max_cycles", max_cycles)
        self.frame_skip = check_count("frame_skip", frame_skip)
        self._cycles = 0
        self.problem, self.config, self.render_mode = problem, config, render_mode
        self.metadata = {
            "name": f"{name}_v{problem.version}",
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
        }
        self._match = problem.match(config, 1, players)
        self.game = self._match.game
        self.outside = {role: Outside(self.game, role, adapter) for role, adapter in adapters.items()}
        self._names = {role: _names(each, alone=len(adapters) == 1) for role, each in self.outside.items()}
        self.possible_agents = [name for names in self._names.values() for name in names]
        self._roles = {name: role for role, names in self._names.items() for name in names}
        self._spaces = {role: each.adapter.fields.space() for role, each in self.outside.items()}
        self._readers = {role: ActionReader(each.adapter.action_space) for role, each in self.outside.items()}
        self._states: dict[Role, State] = {}
        self._seen: dict[Role, Seen] = {}
        self._held: dict[Role, Array] = {}
        self.interval = min(self.game.decision_interval[role] for role in adapters) if len(adapters) == 1 else 1
        self.agents: list[str] = []
        self._generator: np.random.Generator | None = None
        self._envs = np.ones(1, np.bool_)
        self._renderer = Renderer(problem, self.game)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space of an agent, the same for every agent of a role."""
        return self._spaces[self._roles[agent]]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space of an agent, the same for every agent of a role."""
        return self.outside[self._roles[agent]].adapter.action_space

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], Infos]:
        """Start an episode. Without a seed the generator continues."""
        if seed is not None or self._generator is None:
            self._generator = seeding.np_random(seed)[0]
        check_options(options)
        self._match.reset(self._envs, [self._generator])
        self.agents, self._cycles = self.possible_agents[:], 0
        self._states = {role: each.adapter.begin(1) for role, each in self.outside.items()}
        if self.render_mode == "human":
            self._renderer.show()
        self._look()
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
        given = {role: self._read(role, actions) for role in self.outside}
        rewards = self._advance(given)
        for _ in range(1, self.frame_skip):
            if self._over():
                break
            self._look()
            more = self._advance(given)
            rewards = {role: rewards[role] + more[role] for role in rewards}
        self._cycles += 1
        terminated = self._over()
        truncated = not terminated and self._cycles == self._most
        if self.render_mode == "human":
            self._renderer.show()
        paid = {
            name: float(value)
            for role, names in self._names.items()
            for name, value in zip(names, rewards[role][0], strict=True)
        }
        self._look()
        observations, infos = self._observations(), self._infos()
        ends = (dict.fromkeys(self.agents, terminated), dict.fromkeys(self.agents, truncated))
        if terminated or truncated:
            self.agents = []
        return observations, paid, *ends, infos

    def render(self) -> Array | None:
        """A frame, uint8 (H, W, 3), in mode `rgb_array`; None otherwise."""
        return self._renderer.render(self.render_mode)

    def close(self) -> None:
        """Close the window, if one is open."""
        self._renderer.close()

    def _over(self) -> bool:
        return bool(self.game.terminated[0] or self.game.elapsed[0] >= self.game.horizon)

    def _check_agents(self, actions: dict[str, Any]) -> None:
        if not isinstance(actions, Mapping):
            raise ValueError(f"actions = {shown(actions, SHOWN)} must be a dictionary with an action for each agent")
        missing = [agent for agent in self.possible_agents if agent not in actions]
        if missing:
            some = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
            raise ValueError(f"each agent has to act, but {len(missing)} actions are missing: {some}")

    def _read(self, role: Role, actions: dict[str, Any]) -> Array:
        """The checked actions (1, A, ...) of a role's agents."""
        read = [self._readers[role].single(actions[name]) for name in self._names[role]]
        together: Array = np.concatenate(read)[np.newaxis]
        return together

    def _advance(self, given: Mapping[Role, Array]) -> dict[Role, FloatArray]:
        """Go `interval` game steps; each role's rewards (1, A)."""
        payoff = self._match.step(self._moves(given), self._envs, self.interval)
        return {role: each.rewards(payoff) for role, each in self.outside.items()}

    def _moves(self, given: Mapping[Role, Array]) -> dict[Role, Array]:
        """The roles' actions in force: new ones where a decision of the role is due, held ones otherwise."""
        for role, each in self.outside.items():
            if self.game.elapsed[0] % self.game.decision_interval[role] == 0:
                self._held[role], self._states[role] = each.act(self._seen[role], self._states[role], given[role])
        return dict(self._held)

    def _look(self) -> None:
        self._seen = {role: each.seen() for role, each in self.outside.items()}

    def _observations(self) -> dict[str, Observation]:
        shown: dict[str, Observation] = {}
        for role, each in self.outside.items():
            rows = each.adapter.observe(self._seen[role], self._states[role])[0]
            shown |= {name: row.copy() for name, row in zip(self._names[role], rows, strict=True)}
        return shown

    def _infos(self) -> Infos:
        """Metrics, and `action_mask` where not all actions are legal.

        The mask is in the form that `action_space.sample(mask)` takes, as PettingZoo expects: a tuple of arrays for
        MultiDiscrete.
        """
        metrics = self.game.episode_metrics(0)
        infos: Infos = {name: dict(metrics) for name in self.possible_agents}
        for role, each in self.outside.items():
            masks = each.adapter.masks(self._seen[role], self._states[role])
            if masks is None:
                continue
            for place, name in enumerate(self._names[role]):
                infos[name]["action_mask"] = _mask(masks[0, place], each.adapter.action_space)
        return infos


def _names(outside: Outside, *, alone: bool) -> list[str]:
    """The agents of a role in the environment; a team says its role where the other role is played from outside too."""
    if len(outside.agents) == 1:
        return [AGENTS[outside.role]]
    return [agent if alone else f"{outside.role}_{agent}" for agent in outside.agents]


def _mask(mask: Array, space: spaces.Space[Any]) -> Any:
    """A mask (k,) as `space.sample` takes it."""
    fresh = mask.astype(np.int8)
    if not isinstance(space, spaces.MultiDiscrete):
        return fresh
    return tuple(np.split(fresh, np.cumsum(choices_of(space))[:-1]))
