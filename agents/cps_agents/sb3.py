"""Train with stable-baselines3: a batch of episodes as its `VecEnv`.

`envs = make("RogueAttack")`, then `PPO("MlpPolicy", envs, **envs.settings)`.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation
from cps_envs.registration import learning_env

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.utils import LinearSchedule
    from stable_baselines3.common.vec_env import VecNormalize
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices
except ImportError:
    require("stable_baselines3", extra="sb3", purpose="training with stable-baselines3")
    raise

__all__ = ["BatchVecEnv", "as_sb3", "make"]
Step = tuple[Observation, Array, BoolArray, list[dict[str, Any]]]


class BatchVecEnv(VecEnv):
    """The environments of a vector environment as stable-baselines3 sees them.

    An environment's info is empty until its episode ends; with `metrics` it holds the game's metrics and the `cost` of
    each step, which takes time. At the end of an episode it holds final metrics, `terminal_observation`,
    `TimeLimit.truncated`, and `episode` with the undiscounted return `r` and the length `l`, from which `learn` prints
    `ep_rew_mean` and `evaluate_policy` judges; an episode whose beginning was cut off has none. Attributes and methods
    are those of the batch; `action_masks` gives each environment its row.

    `seed` chooses among seeds for training, see `cps_envs.core.declare.seeds`: no episode of an
    evaluation is ever played.
    """

    def __init__(self, env: RoleVectorEnv, *, metrics: bool = False) -> None:
        self.env, self.metrics = env, metrics
        self._actions: Array | None = None
        self._run: int | None = None
        self._returns: FloatArray = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, np.int64)
        self._everybody = np.ones(env.num_envs, np.bool_)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments of PPO with which an ordinary learner learns here."""
        training = self.env.training if isinstance(self.env, LearningVectorEnv) else None
        if training is None:
            return {"device": "cpu"}
        chosen = dict(training.ppo)
        if "final_learning_rate" in chosen:  # not of PPO: its rate falls to this one
            chosen["learning_rate"] = LinearSchedule(chosen["learning_rate"], chosen.pop("final_learning_rate"), 1.0)
        return {"device": "cpu", **chosen}

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Let the next `reset` play the episodes of a training run, numbered from 0.

        Raises:
            ConfigurationError: there are not so many.
        """
        if seed is not None:
            training_seed(seed)
        self._run = seed
        return [seed] * self.num_envs

    def reset(self) -> Observation:
        """Start an episode in every environment, with the seeds that `seed` has set."""
        run, self._run = self._run, None
        if run is not None and not isinstance(self.env, LearningVectorEnv):  # which numbers runs itself
            run = training_seed(run)
        observation, _ = self.env.reset(seed=run)
        self._returns[:], self._lengths[:] = 0.0, 0
        self._reset_options()
        return observation

    def step_async(self, actions: Array) -> None:
        """Keep the actions (B, ...) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Step:
        """Observations, float32 rewards, whether episodes have ended, and one info per environment."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        self._returns += reward
        self._lengths += 1
        done = terminated | truncated
        infos: list[dict[str, Any]] = self._measured(info) if self.metrics else [{} for _ in range(self.num_envs)]
        for b in np.flatnonzero(done):
            infos[b] = self._final(info, int(b))
            infos[b]["TimeLimit.truncated"] = bool(truncated[b] and not terminated[b])
            self._returns[b], self._lengths[b] = 0.0, 0
        return observation, reward.astype(np.float32), done, infos

    def _measured(self, info: dict[str, Any]) -> list[dict[str, Any]]:
        """The metrics of each environment after a step."""
        rows = {
            name: value.tolist()
            for name, value in info.items()
            if not name.startswith("_") and isinstance(value, np.ndarray) and value.shape == (self.num_envs,)
        }
        return [{name: values[b] for name, values in rows.items()} for b in range(self.num_envs)]

    def _final(self, info: dict[str, Any], b: int) -> dict[str, Any]:
        last: dict[str, Any] = info["final_info"]
        final = {
            name: value.item(b)
            for name, value in last.items()
            if not name.startswith("_") and isinstance(value, np.ndarray) and value.ndim == 1
        }
        episode = last.get("episode", {"r": self._returns, "l": self._lengths})
        if last.get("_episode", self._everybody)[b]:
            final["episode"] = {"r": float(episode["r"][b]), "l": int(episode["l"][b]), "t": 0.0}
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
        """No environment is wrapped, but infos have `episode` as `Monitor` writes it, so for that it says True."""
        return [issubclass(wrapper_class, Monitor)] * len(self._envs(indices))

    def get_images(self) -> list[Array]:
        """A frame per environment, in mode `rgb_array`."""
        frames: Any = self.env.render()
        return list(frames or ())

    def close(self) -> None:
        """Close the vector environment."""
        self.env.close()

    def _envs(self, indices: VecEnvIndices) -> list[int]:
        return list(self._get_indices(indices))


class ScaledRewards(VecNormalize):
    """Environments whose rewards are divided by the deviation of the discounted return; `episode` keeps the return."""

    def __init__(self, envs: BatchVecEnv, gamma: float, *, evaluation: bool = False) -> None:
        """In an evaluation rewards are as they are."""
        super().__init__(envs, training=not evaluation, norm_obs=False, norm_reward=not evaluation, gamma=gamma)

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments of PPO with which an ordinary learner learns here: `PPO("MlpPolicy", envs, **envs.settings)`."""
        envs: Any = self.venv
        found: dict[str, Any] = envs.settings
        return found


def make(
    name: str, num_envs: int | None = None, *, evaluation: bool = False, metrics: bool = False, **options: Any
) -> ScaledRewards:
    """Environments of a role such as "RogueAttack", in which a learner of stable-baselines3 learns.

    `options` are those of `cps_envs.core.interfaces.learning_env.LearningVectorEnv`, such as `preset`, `opponent` and
    `adapter`. A team's agents are environments of their own. The observation space holds how the inputs are made, and
    `model.save` saves it, so `sb3:FILE.zip` plays the model again anywhere in this package.

    With `evaluation=True` they are for `evaluate_policy` and `EvalCallback`: each evaluation plays the same validation
    episodes from their first step, with rewards as they are. Give the other options of training, too. A model that was
    trained in another configuration has inputs of another scale: `scaling=model.observation_space`.

    With `metrics=True` the infos of every step have the game's metrics and `cost`, for callbacks that watch them.

    Raises:
        UnknownNameError: there is no such role, adapter or opponent.
        ConfigurationError: an option that cannot be right.
    """
    env = learning_env(name, num_envs, evaluation=evaluation, **options)
    return ScaledRewards(
        BatchVecEnv(env, metrics=metrics), float(env.training.ppo.get("gamma", 0.99)), evaluation=evaluation
    )


def as_sb3(vector_env: Any, *, metrics: bool = False) -> BatchVecEnv:
    """A vector environment of this package as a stable-baselines3 `VecEnv`, just as it is; `make` prepares more.

    With `metrics` the infos of every step have the game's metrics and `cost`.

    Make it with `autoreset="same_step"`:
    `gymnasium.make_vec("cps_envs:cps_envs/DisbandingAttack-v0", 64, "vector_entry_point", autoreset="same_step")`

    Raises:
        ConfigurationError: not a native vector environment, a wrapped one, or in another autoreset mode.
    """
    env = vector_env
    if isinstance(getattr(env, "unwrapped", None), RoleVectorEnv) and env is not env.unwrapped:
        raise ConfigurationError(
            f"{type(env).__name__} wraps a vector environment of cps_envs, and stable-baselines3 would not see what it "
            "does. Hand over the environment itself, and wrap the result with stable-baselines3's own wrappers, such "
            "as VecNormalize"
        )
    if not isinstance(env, RoleVectorEnv):
        raise ConfigurationError(
            f"{type(env).__name__} is not a native vector environment of cps_envs: make it with "
            'gymnasium.make_vec(id, num_envs, vectorization_mode="vector_entry_point", autoreset="same_step")'
        )
    if env.metadata["autoreset_mode"] != AutoresetMode.SAME_STEP:
        raise ConfigurationError('stable-baselines3 needs a vector environment made with autoreset="same_step"')
    return BatchVecEnv(env, metrics=metrics)
