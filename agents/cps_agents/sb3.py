"""Native vector environments for stable-baselines3, without one process or one object per environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import Array, BoolArray, Observation

try:
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices
except ImportError:
    require("stable_baselines3", extra="train", purpose="training with stable-baselines3")
    raise

Step = tuple[Observation, Array, BoolArray, list[dict[str, Any]]]


class BatchVecEnv(VecEnv):
    """The environments of a vector environment as stable-baselines3 sees them.

    An environment's info is empty until its episode ends; then it holds final metrics, `terminal_observation` and
    `TimeLimit.truncated`. Attributes and methods are those of the batch; `action_masks` gives each environment its row.
    """

    def __init__(self, env: RoleVectorEnv) -> None:
        self.env = env
        self._actions: Array | None = None
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Observation:
        """Start an episode in every environment, with the seeds that `seed` has set."""
        observation, _ = self.env.reset(seed=self._seeds)
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: Array) -> None:
        """Keep the actions (B, ...) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Step:
        """Observations, float32 rewards, whether episodes have ended, and one info per environment."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for b in np.flatnonzero(done):
            infos[b] = self._final(info, int(b))
            infos[b]["TimeLimit.truncated"] = bool(truncated[b] and not terminated[b])
        return observation, reward.astype(np.float32), done, infos

    def _final(self, info: dict[str, Any], b: int) -> dict[str, Any]:
        metrics = ((name, value) for name, value in info["final_info"].items() if not name.startswith("_"))
        final = {name: value.item(b) for name, value in metrics if value.ndim == 1}
        return {**final, "terminal_observation": info["final_obs"][b]}

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the batch, once for each environment.

        Raises:
            AttributeError: there is none, or action masks are asked for where all actions are legal.
        """
        return [getattr(self.env, attr_name)] * len(self._envs(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the whole batch.

        Raises:
            ValueError: only some of the environments are meant.
        """
        if len(self._envs(indices)) < self.num_envs:
            raise ValueError(f"the environments are one object: {attr_name!r} can be set for all of them only")
        setattr(self.env, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """What a method of the batch returns: row by row for `action_masks`, the same for each otherwise."""
        result = getattr(self.env, method_name)(*args, **kwargs)
        envs = self._envs(indices)
        return [result[b] for b in envs] if method_name == "action_masks" else [result] * len(envs)

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Any = None
    ) -> list[bool]:
        """No environment is wrapped."""
        return [False] * len(self._envs(indices))

    def get_images(self) -> list[Array]:
        """A frame per environment, in mode `rgb_array`."""
        return list(self.env.render() or ())

    def close(self) -> None:
        """Close the vector environment."""
        self.env.close()

    def _envs(self, indices: VecEnvIndices) -> list[int]:
        return list(self._get_indices(indices))


def as_sb3(vector_env: Any) -> BatchVecEnv:
    """A vector environment of this package as a stable-baselines3 `VecEnv`.

    Make it with `autoreset_mode="SameStep"`:
    `gymnasium.make_vec("cps_envs:cps_envs/DisbandingAttack-v0", 64, "vector_entry_point", autoreset_mode="SameStep")`

    Raises:
        ConfigurationError: not a native vector environment, or in another autoreset mode.
    """
    env = vector_env.unwrapped
    if not isinstance(env, RoleVectorEnv):
        raise ConfigurationError(
            f"{type(env).__name__} is not a native vector environment of cps_envs: make it with "
            'gymnasium.make_vec(id, num_envs, vectorization_mode="vector_entry_point", autoreset_mode="SameStep")'
        )
    if env.autoreset_mode != AutoresetMode.SAME_STEP:
        raise ConfigurationError('stable-baselines3 needs a vector environment made with autoreset_mode="SameStep"')
    return BatchVecEnv(env)
