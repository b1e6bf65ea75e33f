"""A vector environment as a learner sees it: actions held, rewards scaled, agents of a team side by side."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices

from cps_agents.learning.recipe import Recipe
from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Observation
from cps_envs.registration import find_problem

Step = tuple[Observation, Array, BoolArray, list[dict[str, Any]]]


def make_envs(recipe: Recipe, seed: int) -> TrainingEnvs:
    """The environments of a recipe, whose first one has `seed`."""
    options: dict[str, Any] = dict(recipe.overrides) | {"preset": recipe.preset, "frame_skip": recipe.hold}
    if recipe.opponent:
        options["opponent"] = recipe.opponent
    env_id = find_problem(recipe.problem).env_id(recipe.role)
    env: Any = gymnasium.make_vec(
        env_id, recipe.num_envs, "vector_entry_point", autoreset_mode=AutoresetMode.DISABLED, **options
    )
    envs = TrainingEnvs(env, recipe)
    envs.seed(seed)
    return envs


class TrainingEnvs(VecEnv):
    """Each environment, in the swarm form each agent of each environment, is an environment of stable-baselines3.

    Info is empty until an episode ends; then it holds `episode` (undiscounted, unscaled return and number of actions)
    and `terminal_observation`. `TimeLimit.truncated`, which makes learners add the value of what would come after, is
    set at the clock's end only if the recipe says `bootstrap`.
    """

    def __init__(self, env: RoleVectorEnv, recipe: Recipe) -> None:
        self.env, self._recipe = env, recipe
        self.team = Outside(env.game, env.role, env.problem.swarm[env.role]) if recipe.swarm else None
        self._agents = len(self.team.agents) if self.team else 1
        self.fields = self.team.adapter.fields if self.team else env.game.fields[env.role]
        self._actions: Array | None = None
        self._earned, self._learned = np.zeros((2, env.num_envs * self._agents))
        env.on_decision = self._earn
        self._returns = np.zeros(env.num_envs * self._agents)
        self._lengths = np.zeros(env.num_envs * self._agents, np.int64)
        actions = self.team.adapter.action_space if self.team else env.single_action_space
        super().__init__(env.num_envs * self._agents, self.fields.space(), actions)

    def reset(self) -> Observation:
        """Start an episode in every environment."""
        self.env.reset(seed=self._seeds[0])
        self._reset_seeds()
        self._returns[:], self._lengths[:] = 0.0, 0
        return self.observe()

    def observe(self) -> Observation:
        """What every agent sees now (B, n)."""
        if self.team is None:
            return self.env.game.observe(self.env.role)
        rows = self.team.adapter.observe(self.team.seen(), ())
        return rows.reshape(-1, rows.shape[-1])

    def step_async(self, actions: Array) -> None:
        """Keep the actions (B, ...) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Step:
        """Observations, scaled float32 rewards, whether episodes have ended, and one info per agent."""
        assert self._actions is not None
        self._earned, self._learned = np.zeros((2, self.num_envs))
        observation, _, done, _, _ = self.env.step(self._joined(self._actions))
        self._returns += self._earned
        self._lengths += 1
        infos = self._infos(done, done & ~self.env.game.terminated)
        if done.any():
            self.env.reset(options={"reset_mask": done})
        scaled = (self._recipe.reward_scale * self._learned).astype(np.float32)
        if done.any() or self.team is not None:
            observation = self.observe()
        return observation, scaled, np.repeat(done, self._agents), infos

    def _earn(self, payoff: FloatArray, moved: BoolArray) -> None:
        """Add what a decision was worth (B,) in the environments that moved; an action may be held for several."""
        game = self.env.game
        own = self._rewards(SIGN[self.env.role] * payoff)
        ended = moved & (game.terminated | (game.elapsed >= game.horizon))
        mine = np.repeat(moved, self._agents)
        self._earned += own
        self._learned += np.where(mine, self._recipe.learned(game, own, ended), 0.0)

    def _joined(self, actions: Array) -> Array:
        if self.team is None:
            return actions
        taken = actions.reshape(self.env.num_envs, self._agents, -1)
        return self.team.act(self.team.seen(), (), taken)[0]

    def _rewards(self, reward: FloatArray) -> FloatArray:
        """The agents' rewards, from the role's (B,)."""
        return reward if self.team is None else self.team.rewards(-reward).reshape(-1)

    def _infos(self, done: BoolArray, cut: BoolArray) -> list[dict[str, Any]]:
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if not done.any():
            return infos
        last = self.observe()
        for row in np.flatnonzero(np.repeat(done, self._agents)).tolist():
            infos[row] = {
                "episode": {"r": float(self._returns[row]), "l": int(self._lengths[row]), "t": 0.0},
                "terminal_observation": last[row],
                "TimeLimit.truncated": bool(self._recipe.bootstrap and cut[row // self._agents]),
            }
            self._returns[row], self._lengths[row] = 0.0, 0
        return infos

    def action_masks(self) -> BoolArray:
        """Legal actions (B, k).

        Raises:
            AttributeError: all actions are legal.
        """
        mask = self.masks()
        if mask is None:
            raise AttributeError(f"the {self.env.role} of {self.env.game.name!r} has no action masks")
        return mask

    def masks(self) -> BoolArray | None:
        """What may be played (B, k); None where everything may."""
        mask = self._recipe.masks(self.env.game)
        return None if mask is None else mask.reshape(self.num_envs, -1)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the environments, once for each; `action_masks` only where there are any."""
        if attr_name == "action_masks":
            self.action_masks()
        if attr_name == "render_mode":
            return [None] * self.num_envs
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """The environments are one object.

        Raises:
            ValueError: always.
        """
        raise ValueError(f"{attr_name!r} cannot be set: make the environments anew")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """What a method of the environments returns, row by row."""
        return list(getattr(self, method_name)(*args, **kwargs))

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Any = None
    ) -> list[bool]:
        """They count their own episodes, as a Monitor does."""
        return [True] * self.num_envs

    def close(self) -> None:
        """Close the vector environment."""
        self.env.close()
