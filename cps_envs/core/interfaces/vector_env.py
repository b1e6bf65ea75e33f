"""One role of a game as a `gymnasium.vector.VectorEnv`: the batch itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from cps_envs.core.compute.clock import mark_ends
from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.errors import shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.info import batch_info
from cps_envs.core.interfaces.masks import masks_of
from cps_envs.core.interfaces.options import check_autoreset, check_count, check_options
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Generators, Observation, Role, other

Step = tuple[Observation, FloatArray, BoolArray, BoolArray, dict[str, Any]]


class RoleVectorEnv(VectorEnv[Observation, Any, Array]):
    """Base of the vector environments. Environment i of a batch seeded s equals the single environment seeded s + i.

    With `frame_skip=k` an action is held for k decisions, or until the episode ends, as in `RoleEnv`. `num_threads`
    threads step the environments side by side, with the same results. More threads pay off with hundreds of
    environments.
    """

    problem: ClassVar[Problem]
    role: ClassVar[Role]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        frame_skip: int = 1,
        num_threads: int = 1,
        **overrides: Any,
    ) -> None:
        check_render_mode(render_mode)
        self.frame_skip = check_count("frame_skip", frame_skip)
        self.num_envs, self.render_mode = check_count("num_envs", num_envs), render_mode
        self.autoreset_mode = check_autoreset(autoreset_mode)
        self.metadata = {
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
            "autoreset_mode": self.autoreset_mode,
        }
        self.config = self.problem.config(preset, overrides)
        rival = other(self.role)
        self.opponent = self.problem.opponent(preset, rival) if opponent is None else opponent
        self._match = self.problem.match(self.config, num_envs, {rival: self.opponent})
        self.game = self._match.game
        self.game.use_threads(check_count("num_threads", num_threads))
        self._interval = self.game.decision_interval[self.role]
        self._limit = self.game.horizon
        if max_episode_steps is not None:
            steps = check_count("max_episode_steps", max_episode_steps)
            self._limit = min(self._limit, steps * self._interval * self.frame_skip)
        self._limits = (self.game.horizon, self._limit)
        self._generators: Generators = ()
        self._everyone = np.ones(num_envs, np.bool_)  # never written to
        self._nobody = np.zeros(num_envs, np.bool_)  # nor is this
        self._ended, self._any_ended = self._nobody, False
        self._renderer = Renderer(self.problem, self.game)
        self.single_observation_space = self.game.fields[self.role].space()
        self.single_action_space = self.game.action_space[self.role]
        self._reader = ActionReader(self.single_action_space)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of `options["reset_mask"]`, a boolean array (B,).

        Environments without a seed continue with their own generator.
        """
        envs = self._reset_mask(options)
        self._seed(seed, envs)
        self._restart(envs)
        if self.render_mode == "human":
            self._renderer.show()
        return self.game.observe(self.role), batch_info(self.game, self.role, envs)

    def step(self, actions: Any) -> Step:
        """Advance every environment by `frame_skip` decisions of this role. Reset ended ones by `autoreset_mode`.

        Raises:
            ResetNeeded: before the first reset, or for an ended environment when automatic resetting is disabled.
            ValueError: the actions have a wrong shape, are not finite or lie outside the action space.
        """
        self._check_running()
        checked = self._reader.batch(actions, self.num_envs)
        live, game = self._everyone, self.game
        if self._any_ended:  # environments that NEXT_STEP resets instead of stepping
            live = ~self._ended
            self._match.reset(self._ended, self._generators)
        payoff = self._match.hold({self.role: checked}, live, self._interval, self.frame_skip, self._limit)
        terminated, truncated = np.empty(self.num_envs, np.bool_), np.empty(self.num_envs, np.bool_)
        self._any_ended = mark_ends(game.terminated, game.elapsed, self._limits, live, terminated, truncated) > 0
        self._ended = terminated | truncated if self._any_ended else self._nobody
        again = self._any_ended and self.autoreset_mode == AutoresetMode.SAME_STEP
        final = self._restart_ended() if again else {}
        if self.render_mode == "human":
            self._renderer.show()
        info = batch_info(game, self.role)
        info.update(final)
        return game.observe(self.role), SIGN[self.role] * payoff, terminated, truncated, info

    @property
    def action_masks(self) -> Callable[[], BoolArray]:
        """A function that returns the legal actions (B, k).

        Raises:
            AttributeError: this role has no masks. So `hasattr` tells whether it has any.
        """
        return masks_of(self.game, self.role)

    def render(self) -> tuple[Array, ...] | None:
        """One frame per environment in mode `rgb_array`; in mode `human` the first environment is shown."""
        if self.render_mode == "rgb_array":
            return tuple(self._renderer.frame(b) for b in range(self.num_envs))
        self._renderer.render(self.render_mode)
        return None

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if one is open."""
        self._renderer.close()

    def _check_running(self) -> None:
        if not self._generators:
            raise ResetNeeded("call reset() before step()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(
                f'environments {ended} have ended: call reset(options={{"reset_mask": mask}}) for them first'
            )

    def _restart(self, envs: BoolArray) -> None:
        self._match.reset(envs, self._generators)
        self._ended = self._ended & ~envs
        self._any_ended = bool(self._ended.any())

    def _restart_ended(self) -> dict[str, Any]:
        """Reset environments that have just ended; their last observation and info as Gymnasium's `final_*` entries."""
        ended = self._ended
        last = self.game.observe(self.role)
        final_obs = np.full(self.num_envs, None, dtype=object)
        for b in np.flatnonzero(ended):
            final_obs[b] = last[b]
        final_info = batch_info(self.game, self.role, ended)
        self._restart(ended)
        return {
            "final_obs": final_obs,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }

    def _reset_mask(self, options: dict[str, Any] | None) -> BoolArray:
        everything = self._everyone
        check_options(options)
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return everything
        if not isinstance(mask, np.ndarray) or mask.shape != everything.shape or mask.dtype != np.bool_:
            raise ValueError(f'options["reset_mask"] must be a boolean numpy array of shape ({self.num_envs},)')
        if not mask.any():
            raise ValueError('options["reset_mask"] marks no environment')
        if not self._generators and not mask.all():
            raise ResetNeeded("the first reset() has to start every environment: leave out the reset_mask")
        return mask

    def _seed(self, seed: int | Sequence[int | None] | None, envs: BoolArray) -> None:
        seeds = self._seeds_of(seed)
        first = not self._generators
        wanted = [b for b in np.flatnonzero(envs).tolist() if first or seeds[b] is not None]
        if not wanted:
            return
        made: Generators = seeded([seeds[b] for b in wanted])  # all of them, or an error and none
        if len(wanted) < self.num_envs:
            new = dict(zip(wanted, made, strict=True))
            made = [new.get(b) or self._generators[b] for b in range(self.num_envs)]
        self._generators = made

    def _seeds_of(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        """A seed for each environment, or None."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
            return [int(seed) + i for i in range(self.num_envs)]
        if not isinstance(seed, (list, tuple, np.ndarray)):
            raise ValueError(f"seed = {shown(seed)} must be a whole number, one for each environment, or None")
        if len(seed) != self.num_envs:
            raise ValueError(f"one seed per environment is needed: {self.num_envs} environments, {len(seed)} seeds")
        for each in seed:
            if each is not None and (isinstance(each, (bool, np.bool_)) or not isinstance(each, (int, np.integer))):
                raise ValueError(f"seed = {shown(seed)}: {shown(each)} is no whole number, and not None")
        return [None if each is None else int(each) for each in seed]
