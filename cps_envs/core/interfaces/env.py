"""One role of a game as a `gymnasium.Env`: the batch with a single environment."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.configured import Configured, Stage, stage_of
from cps_envs.core.interfaces.info import Costs, episode_info
from cps_envs.core.interfaces.masks import masks_of
from cps_envs.core.interfaces.options import check_seed
from cps_envs.core.learning.setting import decisions_of, rival_of, setting
from cps_envs.core.learning.wiring import Scaling, WiredBox
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Array, BoolArray, Observation, Role


class RoleEnv(Configured, gymnasium.Env[Observation, Any]):
    """Base of the single environments. A subclass names its problem and role, and its docstring documents them.

    `interface="learning"` is what learners meet, and the default in preset `learning`: actions through an adapter, each
    held for a while, inputs scaled and averaged, a team as one agent. `interface="native"` has the game's own
    observations and actions, and is the default elsewhere. With `frame_skip=k` an action is held for k decisions, or
    until the episode ends; the reward is the sum over these. `flat=True` makes one number of all entries of an action.

    `config` and `opponent` are read-only; `configure` changes them from the next reset on.
    """

    problem: ClassVar[Problem]
    role: ClassVar[Role]
    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": FRAMES_PER_SECOND}
    overrides: Mapping[str, Any]  # fields of the configuration that are not the preset's
    frame_skip: int  # decisions of the role in a step
    waits: bool  # whether a step ends as soon as something is to be decided again

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__doc__ = cls.problem.document(inspect.getdoc(cls) or "", cls.role)

    def __init__(
        self,
        *,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        interface: str | None = None,
        flat: bool = False,
        scaling: Scaling | WiredBox | None = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        """`options` are settings of the interface, such as `frame_skip` and `adapter`, and fields of the configuration.

        `scaling` is mean and deviation of the inputs, or an observation space that has them, such as that of a model
        which is to go on learning here; by default those that ship, or for another configuration measured once.

        Raises:
            ConfigurationError: an unknown preset, field or interface, or a value that cannot be right.
            UnknownNameError: there is no such opponent or adapter.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        found = setting(self.problem, self.role, preset, interface, options)
        self.config, self.preset, self.interface = found.config, found.preset, found.interface
        self.opponent = rival_of(found, opponent)
        self._form = {"joint": True, "flat": flat}
        self._envs = np.ones(1, np.bool_)
        self._running = False
        self._first = stage_of(found, self.opponent, 1, scaling=scaling, **self._form)
        self._use(self._first)
        self.observation_space = self._side.observation_space
        self.action_space = self._side.action_space
        self.neutral_action = self._side.neutral_action
        self._reader = ActionReader(self.action_space)
        self._seal()

    def _use(self, stage: Stage) -> None:
        game, side = stage.game, stage.side
        self._stage, self._match, self._side, self._costs = stage, stage.match, side, Costs(self.problem, game)
        self._renderer = Renderer(self.problem, game)
        settled = {"overrides": stage.setting.overrides, "frame_skip": side.frame_skip, "waits": side.waits}
        vars(self).update(game=game, **settled)

    @property
    def decisions(self) -> int:
        """How often an agent decides in an episode that the clock ends."""
        return decisions_of(self._match, self.role, self.frame_skip)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode. Without a seed the environment's generator continues.

        `options` set quantities that episodes draw, for this episode only: `{"power_ratio": 2.5}`, or a pair to draw
        from.

        Raises:
            ConfigurationError: options name what no episode draws, or a value that this environment is not made for.
            ValueError: the seed is no whole number from 0 on, or the options are no dictionary.
        """
        drawn = self._asked(options)
        super().reset(seed=check_seed(seed))
        self._renew()
        self._match.reset(self._envs, [self.np_random], drawn)
        self._side.begin(self._envs)
        self._costs.begin(self._envs)
        self._running = self._begun = True
        if self.render_mode == "human":
            self._renderer.show()
        return self._side.observe()[0], episode_info(self.game, self._side, self._costs)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one decision of this role, or by `frame_skip` of them with the same action.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: the action has a wrong shape, is not finite, or is discrete and not in the action space. A Box
                action outside its bounds counts as the nearest one inside.
        """
        if not self._running:
            raise ResetNeeded("no episode is running: call reset() before step(), and again after an episode has ended")
        game = self.game
        _, rewards = self._side.step(self._reader.single(action), self._envs, game.horizon)
        terminated = game.terminated.item(0) or game.elapsed.item(0) >= game.horizon
        self._running = not terminated
        if self.render_mode == "human":
            self._renderer.show()
        observation = self._side.observe()[0]
        return observation, rewards.item(0), terminated, False, episode_info(game, self._side, self._costs)

    @property
    def action_masks(self) -> Callable[[], BoolArray]:
        """A function that returns the legal actions (k,), in the form that sb3-contrib's MaskablePPO asks for.

        Raises:
            AttributeError: everything in the action space is legal. So `hasattr` tells whether there are masks.
            ResetNeeded: the function is called before the first reset.
        """
        masks = masks_of(self._side, self.game, self.role, self.check_begun)
        return lambda: masks()[0]

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
