"""One role of a game as a `gymnasium.Env`: the batch with a single environment."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.info import episode_info
from cps_envs.core.interfaces.masks import masks_of
from cps_envs.core.interfaces.options import check_count, check_options
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import SIGN, Array, BoolArray, Observation, Role, other


class RoleEnv(gymnasium.Env[Observation, Any]):
    """Base of the single environments. A subclass names its problem and role, and its docstring documents them.

    With `frame_skip=k` an action is held for k decisions, or until the episode ends. Nothing is observed in between.
    The reward is the sum over these decisions.
    """

    problem: ClassVar[Problem]
    role: ClassVar[Role]
    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": FRAMES_PER_SECOND}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__doc__ = cls.problem.document(inspect.getdoc(cls) or "", cls.role)

    def __init__(
        self,
        *,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        render_mode: str | None = None,
        frame_skip: int = 1,
        **overrides: Any,
    ) -> None:
        check_render_mode(render_mode)
        self.frame_skip = check_count("frame_skip", frame_skip)
        self.render_mode = render_mode
        self.config = self.problem.config(preset, overrides)
        rival = other(self.role)
        self.opponent = self.problem.opponent(preset, rival) if opponent is None else opponent
        self._match = self.problem.match(self.config, 1, {rival: self.opponent})
        self.game = self._match.game
        self._interval = self.game.decision_interval[self.role]
        self._envs = np.ones(1, np.bool_)
        self._running = False
        self._renderer = Renderer(self.problem, self.game)
        self.observation_space: spaces.Space[Any] = self.game.fields[self.role].space()
        self.action_space = self.game.action_space[self.role]
        self._reader = ActionReader(self.action_space)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode. Without a seed the environment's generator continues."""
        check_options(options)
        super().reset(seed=seed)
        self._match.reset(self._envs, [self.np_random])
        self._running = True
        if self.render_mode == "human":
            self._renderer.show()
        return self.game.observe(self.role)[0], episode_info(self.game, self.role)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one decision of this role, or by `frame_skip` of them with the same action.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: the action has a wrong shape, is not finite or lies outside the action space.
        """
        if not self._running:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        game, role = self.game, self.role
        actions = {role: self._reader.single(action)}
        payoff = self._match.hold(actions, self._envs, self._interval, self.frame_skip, game.horizon)
        terminated = game.terminated.item(0) or game.elapsed.item(0) >= game.horizon
        self._running = not terminated
        if self.render_mode == "human":
            self._renderer.show()
        observation, reward = game.observe(role)[0], SIGN[role] * payoff.item(0)
        return observation, reward, terminated, False, episode_info(game, role)

    @property
    def action_masks(self) -> Callable[[], BoolArray]:
        """A function that returns the legal actions (k,), in the form that sb3-contrib's MaskablePPO asks for.

        Raises:
            AttributeError: this role has no masks. So `hasattr` tells whether it has any.
        """
        masks = masks_of(self.game, self.role)
        return lambda: masks()[0]

    def render(self) -> Array | None:
        """A frame, uint8 (H, W, 3), in mode `rgb_array`; None otherwise."""
        return self._renderer.render(self.render_mode)

    def close(self) -> None:
        """Close the window, if one is open."""
        self._renderer.close()
