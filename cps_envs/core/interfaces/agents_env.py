"""The PettingZoo interface of a match: one episode, stepped under the actions of several agents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from cps_envs.core.declare.actions import SHOWN, choices_of
from cps_envs.core.errors import near, shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_batch import AgentsBatch, AgentsForm, Hand
from cps_envs.core.interfaces.options import check_seed
from cps_envs.core.learning.outside import Outside
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.types import Array, Observation, Role

Infos = dict[str, dict[str, Any]]
Result = tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], Infos]


class AgentsEnv(AgentsForm, ParallelEnv[str, Observation, Any]):
    """Roles that are played from outside, each through an adapter by one agent or a team; see `AgentsBatch`.

    An agent's `info` has the game's metrics, `cost`, `due` (whether its next action counts; others hold), and
    `action_mask` where not all actions are legal. `state()` is for central critics.
    """

    possible_agents: list[str]
    outside: dict[Role, Outside]

    def __init__(
        self,
        problem: Problem,
        name: str,
        adapters: Mapping[Role, str | None],
        *,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **options: Any,
    ) -> None:
        """`adapters` names those of the roles that are played from outside; `options` are those of `AgentsBatch`."""
        check_render_mode(render_mode)
        super().__init__(problem, name, adapters, 1, max_cycles, options)
        self._cycles, self.render_mode = 0, render_mode
        self.metadata = {"name": self._name, "render_modes": RENDER_MODES, "render_fps": FRAMES_PER_SECOND}
        self.agents: list[str] = []
        self._generator: np.random.Generator | None = None
        self._envs = np.ones(1, np.bool_)
        self._seal()

    def _use(self, stage: AgentsBatch) -> None:
        super()._use(stage)
        vars(self).update(outside={role: hand.outside for role, hand in stage.hands.items()})
        self._renderer = Renderer(self.problem, stage.game)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], Infos]:
        """Start an episode. Without a seed the generator continues.

        `options` set quantities that episodes draw, for this episode only: `{"power_ratio": 2.5}`, or a pair to draw
        from.

        Raises:
            ConfigurationError: options name what no episode draws, or a value that this environment is not made for.
            ValueError: the seed is no whole number from 0 on, or the options are no dictionary.
        """
        drawn, seed = self._asked(options), check_seed(seed)
        if seed is not None or self._generator is None:
            self._generator = seeding.np_random(seed)[0]
        self._renew()
        self._begun = True
        self._batch.reset(self._envs, [self._generator], drawn)
        self.agents, self._cycles = self.possible_agents[:], 0
        if self.render_mode == "human":
            self._renderer.show()
        return self._observations(), self._infos()

    def step(self, actions: dict[str, Any]) -> Result:
        """Advance by one decision of the agents.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: an agent's action is missing, has a wrong shape, is not finite, or is discrete and not in its
                space; or there is no such agent. A Box action outside its bounds counts as the nearest one inside.
        """
        if not self.agents:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        check_agents(actions, self.possible_agents)
        given = {role: _read(hand, actions) for role, hand in self._batch.hands.items()}
        rewards = self._batch.step(given, self._envs)
        self._cycles += 1
        terminated = bool(self._batch.over()[0])
        truncated = not terminated and self._cycles == self._most
        if self.render_mode == "human":
            self._renderer.show()
        paid = {
            name: float(value)
            for role, hand in self._batch.hands.items()
            for name, value in zip(hand.names, rewards[role][0], strict=True)
        }
        observations, infos = self._observations(), self._infos()
        ends = (dict.fromkeys(self.agents, terminated), dict.fromkeys(self.agents, truncated))
        if terminated or truncated:
            self.agents = []
        return observations, paid, *ends, infos

    def check_action(self, agent: str, action: Any) -> None:
        """Check what an agent wants to do.

        Raises:
            ValueError: the action has a wrong shape, is not finite, or is discrete and not in the agent's space.
        """
        self._hand(agent).reader.single(action)

    def state(self) -> Observation:
        """What all roles played from outside observe, and what the episode hides from them, (n,): for critics.

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        shown: Observation = self._batch.state()[0]
        return shown

    def render(self) -> Array | None:
        """A frame, uint8 (H, W, 3), in mode `rgb_array`; None otherwise.

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        return self._renderer.render(self.render_mode)

    def close(self) -> None:
        """Close the window, if one is open."""
        self._renderer.close()

    def _observations(self) -> dict[str, Observation]:
        shown: dict[str, Observation] = {}
        for hand in self._batch.hands.values():
            rows = hand.player.rows()[0]
            shown |= {name: row.copy() for name, row in zip(hand.names, rows, strict=True)}
        return shown

    def _infos(self) -> Infos:
        """Masks are in the form that `action_space.sample(mask)` takes: a tuple of arrays for MultiDiscrete."""
        metrics = {name: values.item(0) for name, values in self._batch.costs.add(self.game.metrics()).items()}
        infos: Infos = {name: dict(metrics) for name in self.possible_agents}
        for hand in self._batch.hands.values():
            masks, due = hand.player.masks(), bool(self._batch.due(hand)[0])
            for place, name in enumerate(hand.names):
                infos[name]["due"] = due
                if masks is not None:
                    infos[name]["action_mask"] = _mask(masks[place], hand.action_space)
        return infos


def check_agents(actions: Any, agents: list[str]) -> None:
    """Check that there is an action for every agent, and for nobody else.

    Raises:
        ValueError: there is not.
    """
    if not isinstance(actions, Mapping):
        raise ValueError(f"actions = {shown(actions, SHOWN)} must be a dictionary with an action for each agent")
    missing = [agent for agent in agents if agent not in actions]
    if missing:
        some = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        raise ValueError(f"each agent has to act, but {len(missing)} actions are missing: {some}")
    if len(actions) > len(agents):
        odd = next(name for name in actions if name not in agents)
        raise ValueError(f"there is no agent {shown(odd, SHOWN)} to act. {near(str(odd), agents)}")


def _read(hand: Hand, actions: Mapping[str, Any]) -> Array:
    """The checked actions (A, ...) of a role's agents."""
    together: Array = np.concatenate([hand.reader.single(actions[name]) for name in hand.names])
    return together


def _mask(mask: Array, space: spaces.Space[Any]) -> Any:
    """A mask (k,) as `space.sample` takes it."""
    fresh = mask.astype(np.int8)
    if not isinstance(space, spaces.MultiDiscrete):
        return fresh
    return tuple(np.split(fresh, np.cumsum(choices_of(space))[:-1]))
