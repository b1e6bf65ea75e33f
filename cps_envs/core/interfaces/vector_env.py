"""One role of a game as a `gymnasium.vector.VectorEnv`: the batch itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from cps_envs.core.compute.clock import mark_ends
from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.declare.config import check_count
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.configured import Configured, Stage, stage_of
from cps_envs.core.interfaces.info import Costs, batch_info
from cps_envs.core.interfaces.masks import masks_of
from cps_envs.core.interfaces.options import check_autoreset, check_mask, reseeded
from cps_envs.core.learning.setting import Setting, decisions_of, rival_of, setting
from cps_envs.core.learning.wiring import Scaling, WiredBox
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, RENDER_MODES, Renderer, check_render_mode
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Observation, Role

Step = tuple[Observation, FloatArray, BoolArray, BoolArray, dict[str, Any]]


class RoleVectorEnv(Configured, VectorEnv[Observation, Any, Array]):
    """Base of the vector environments. Environment i of a batch seeded s equals the single environment seeded s + i.

    Arguments are those of `RoleEnv`, with the same meaning. `num_threads` threads step the environments side by side,
    with the same results; more threads help with hundreds of environments. With `per_agent=True` each agent of a
    team is an environment with its own part of the reward: B episodes with A agents have B x A rows, all agents of an
    episode side by side, for learners that share one network among agents.
    """

    problem: Problem
    role: Role
    overrides: Mapping[str, Any]  # fields of the configuration that are not the preset's
    frame_skip: int  # decisions of the role in a step
    agents: int  # rows of an episode
    waits: bool  # whether a step ends as soon as something is to be decided again

    def __init__(
        self,
        num_envs: int = 1,
        *,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        interface: str | None = None,
        per_agent: bool = False,
        flat: bool = False,
        scaling: Scaling | WiredBox | None = None,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        autoreset: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        **options: Any,
    ) -> None:
        """`num_envs` episodes; `options` are settings of the interface and fields of the configuration.

        Raises:
            ConfigurationError: an unknown preset, field or interface, or a value that cannot be right.
            UnknownNameError: there is no such opponent or adapter.
        """
        check_render_mode(render_mode)
        self.episodes, self.render_mode = check_count("num_envs", num_envs), render_mode
        self.autoreset_mode = check_autoreset(autoreset)
        self.metadata = {
            "render_modes": RENDER_MODES,
            "render_fps": FRAMES_PER_SECOND,
            "autoreset_mode": self.autoreset_mode,
        }
        found = self._setting(preset, interface, options)
        self.config, self.preset, self.interface = found.config, found.preset, found.interface
        self.opponent = rival_of(found, opponent)
        threads = check_count("num_threads", num_threads)
        self._form = {"joint": not per_agent, "flat": flat, "num_threads": threads}
        self._most = None if max_episode_steps is None else check_count("max_episode_steps", max_episode_steps)
        self._first = stage_of(found, self.opponent, self.episodes, scaling=scaling, **self._form)
        self._use(self._first)
        self.num_envs = self.episodes * self.agents
        self._generators: Generators = ()
        self._everyone = np.ones(self.episodes, np.bool_)  # never written to
        self._nobody = np.zeros(self.episodes, np.bool_)  # nor is this
        self._ended, self._any_ended = self._nobody, False
        self.single_observation_space = self._side.observation_space
        self.single_action_space = self._side.action_space
        self.neutral_action = self._side.neutral_action  # of a row
        self._reader = ActionReader(self.single_action_space)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._seal()

    def _use(self, stage: Stage) -> None:
        game, side = stage.game, stage.side
        self._stage, self._match, self._side, self._costs = stage, stage.match, side, Costs(self.problem, game)
        self._renderer = Renderer(self.problem, game)
        settled = {"overrides": stage.setting.overrides, "frame_skip": side.frame_skip, "waits": side.waits}
        vars(self).update(game=game, agents=side.rows, **settled)
        self._limit = game.horizon
        if self._most is not None:
            if side.waits:
                raise ConfigurationError(
                    "max_episode_steps counts steps of one length, and here a step ends when something is to be "
                    'decided: leave it out, or say interface="native"'
                )
            steps = self._most * game.decision_interval[self.role] * side.frame_skip
            self._limit = min(self._limit, steps)
        self._limits = (game.horizon, self._limit)

    def _setting(self, preset: str | None, interface: str | None, options: dict[str, Any]) -> Setting:
        return setting(self.problem, self.role, preset, interface, options)

    @property
    def decisions(self) -> int:
        """How often an agent decides in an episode that the clock ends."""
        return decisions_of(self._match, self.role, self.frame_skip)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of `options["reset_mask"]`, a boolean array (B,).

        Environments without a seed continue with their own generator. Other `options` set quantities that episodes
        draw, for the episodes that start now only: `{"power_ratio": 2.5}`, or a pair to draw from.

        Raises:
            ConfigurationError: options name what no episode draws, or a value that this environment is not made for.
            ResetNeeded: a first reset, or the first one after `configure`, has to start all environments.
        """
        drawn = self._asked(options, ("reset_mask",))
        envs = self._reset_mask(options)
        self._seed(seed, envs)
        self._once = drawn
        try:
            self._restart(envs)
        finally:
            self._once = None
        if self.render_mode == "human":
            self._renderer.show()
        return self._side.observe(), batch_info(self._side, self._costs.add(self.game.metrics()), envs)

    def step(self, actions: Any) -> Step:
        """Advance every environment by `frame_skip` decisions of this role. Reset ended ones by `autoreset`.

        Raises:
            ResetNeeded: before the first reset, or for an ended environment when automatic resetting is disabled.
            ValueError: the actions have a wrong shape, are not finite, or are discrete and not in the action space. Box
                actions outside their bounds count as the nearest ones inside.
        """
        self._check_running()
        checked = self._reader.batch(actions, self.num_envs)
        live, game = self._everyone, self.game
        if self._any_ended:  # environments that NEXT_STEP resets instead of stepping
            live = ~self._ended
            self._begin(self._ended)
        rewards = self._advance(checked, live)
        terminated, truncated = np.empty(self.episodes, np.bool_), np.empty(self.episodes, np.bool_)
        self._any_ended = mark_ends(game.terminated, game.elapsed, self._limits, live, terminated, truncated) > 0
        if self._next is not None:  # something else is to be played, by all
            truncated, self._any_ended = ~terminated, True
        self._ended = terminated | truncated if self._any_ended else self._nobody
        metrics = self._costs.add(game.metrics())
        final: dict[str, Any] = {}
        if self._any_ended and self.autoreset_mode == AutoresetMode.SAME_STEP:
            final = self._final(metrics)
            self._restart(self._ended)
            metrics = {**metrics, **self.game.metrics()}  # of the new episodes, and what the step has cost
        if self.render_mode == "human":
            self._renderer.show()
        info = batch_info(self._side, metrics)
        info.update(final)
        ends = (terminated, truncated) if self.agents == 1 else (self._by_row(terminated), self._by_row(truncated))
        return self._side.observe(), rewards, *ends, info

    def _advance(self, actions: Array, live: BoolArray) -> FloatArray:
        """Hold actions (num_envs, ...) in the marked episodes; the rewards (num_envs,)."""
        return self._side.step(actions, live, self._limit)[1]

    def _by_row(self, values: Array) -> Array:
        """What holds for episodes (B, ...) for each of their rows."""
        return np.repeat(values, self.agents, axis=0)

    @property
    def action_masks(self) -> Callable[[], BoolArray]:
        """A function that returns the legal actions (B, k).

        Raises:
            AttributeError: this role has no masks. So `hasattr` tells whether it has any.
            ResetNeeded: the function is called before the first reset.
        """
        return masks_of(self._side, self.game, self.role, self.check_begun)

    def render(self) -> tuple[Array, ...] | None:
        """One frame per environment in mode `rgb_array`; in mode `human` the first environment is shown.

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        if self.render_mode == "rgb_array":
            return tuple(self._renderer.frame(row // self.agents) for row in range(self.num_envs))
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

    def _begin(self, envs: BoolArray) -> None:
        """Start episodes in the marked environments; what `configure` has asked for begins with all of them."""
        if envs.all():
            self._renew()
        self._begun = True
        self._play(envs, None if self._next is not None else self._once or self._drawn)

    def _play(self, envs: BoolArray, drawn: Any) -> None:
        """Start episodes in the marked environments, which draw from a configuration; None: the game's."""
        self._match.reset(envs, self._generators, drawn)
        self._side.begin(envs)
        self._costs.begin(envs)

    def _restart(self, envs: BoolArray) -> None:
        self._begin(envs)
        self._ended = self._ended & ~envs
        self._any_ended = bool(self._ended.any())

    def _final(self, metrics: dict[str, Array]) -> dict[str, Any]:
        """The last observation and info of environments that have just ended, as Gymnasium's `final_*` entries."""
        ended = self._by_row(self._ended)
        last = self._side.observe()
        final_obs = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(ended):
            final_obs[row] = last[row]
        return {
            "final_obs": final_obs,
            "_final_obs": ended,
            "final_info": batch_info(self._side, metrics, self._ended),
            "_final_info": ended.copy(),
        }

    def _reset_mask(self, options: dict[str, Any] | None) -> BoolArray:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return self._everyone
        if self.agents > 1 and isinstance(mask, np.ndarray) and mask.shape == (self.num_envs,):
            whole = mask.reshape(self.episodes, self.agents)
            if (whole.any(axis=1) != whole.all(axis=1)).any():
                raise ValueError(f'options["reset_mask"] must mark all {self.agents} rows of an episode, or none')
            mask = whole[:, 0].copy()
        return check_mask(mask, self.episodes, begun=bool(self._generators), alike=self._next is None)

    def _seed(self, seed: int | Sequence[int | None] | None, envs: BoolArray) -> None:
        self._generators = reseeded(self._generators, seed, envs)
