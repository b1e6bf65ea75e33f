"""MultiDiscrete actions as Discrete ones, for learners that know only Discrete actions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array, BoolArray, IntArray, Observation


class DiscreteActions(gymnasium.ActionWrapper[Observation, Any, Any], RecordConstructorArgs):
    """Change one of several choices in a step and keep the others.

    An environment with MultiDiscrete actions of n_1, ..., n_k values becomes one with 1 + n_1 + ... + n_k actions.
    Action 0 changes nothing. Each other action sets one entry to one of its values, entry after entry. An episode
    begins with the neutral action. An entry whose value is no longer legal returns to its neutral value, or to the
    first legal one.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        """Wrap an environment of this package.

        Raises:
            ConfigurationError: its actions are not MultiDiscrete.
        """
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        if not isinstance(env.action_space, spaces.MultiDiscrete):
            raise ConfigurationError(f"only MultiDiscrete actions can be made Discrete, not {env.action_space}")
        sizes = env.action_space.nvec
        self._entry: IntArray = np.repeat(np.arange(len(sizes)), sizes)  # of each action but 0
        self._value: IntArray = np.concatenate([np.arange(size) for size in sizes])
        self._starts: IntArray = np.cumsum(sizes) - sizes
        self.action_space = spaces.Discrete(1 + int(sizes.sum()))
        self._held = self._neutral()

    def _neutral(self) -> Array:
        world: Any = self.env.unwrapped
        return np.array(world.game.neutral_action[world.role], np.int64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode, with the neutral action held."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._held = self._neutral()
        return observation, self._masked(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Change one entry, or none.

        Raises:
            ValueError: the action lies outside the action space.
        """
        observation, reward, terminated, truncated, info = self.env.step(self.action(action))
        return observation, reward, terminated, truncated, self._masked(info)

    def action(self, action: Any) -> Array:
        """The entries (k,) that are in force after an action."""
        number = np.asarray(action).reshape(-1)
        if number.size != 1 or not self.action_space.contains(int(number[0])) or int(number[0]) != number[0]:
            raise ValueError(f"action = {action!r} must be a whole number from 0 to {len(self._entry)}")
        self._held = self._legal(self._held)
        if number[0] > 0:
            place = int(number[0]) - 1
            self._held[self._entry[place]] = self._value[place]
        return self._held.copy()

    @property
    def action_masks(self) -> Callable[[], BoolArray]:
        """A function that returns the legal actions; it exists where the environment has masks.

        Raises:
            AttributeError: everything in the action space is legal.
        """
        masks = self.env.get_wrapper_attr("action_masks")
        return lambda: np.concatenate([[True], masks()])

    def _legal(self, held: Array) -> Array:
        """`held` (k,) with what is not legal now replaced."""
        if not self.has_wrapper_attr("action_masks"):
            return held.copy()
        mask, neutral = self.env.get_wrapper_attr("action_masks")(), self._neutral()
        found = held.copy()
        for place, start in enumerate(self._starts):
            if not mask[start + found[place]]:
                found[place] = neutral[place]
            if not mask[start + found[place]]:
                found[place] = int(np.argmax(mask[start:]))
        return found

    def _masked(self, info: dict[str, Any]) -> dict[str, Any]:
        if "action_mask" not in info:
            return info
        return {**info, "action_mask": np.concatenate([np.ones(1, np.int8), info["action_mask"]])}
