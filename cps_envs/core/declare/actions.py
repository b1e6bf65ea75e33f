"""Reading actions from outside: shape, type and range are checked before the physics sees them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray

INT64 = np.dtype(np.int64)
SHOWN = 60  # characters of what is no action
MOST_FLAT = 4096  # values of one number that stands for all entries of an action


class ActionReader:
    """Turns what callers hand over into arrays (B, ...): float64 for a Box, int64 for Discrete and MultiDiscrete.

    Continuous actions outside the box are clipped to it, as Gaussian policies expect; everything else that does not lie
    in the space raises ValueError.
    """

    def __init__(self, space: spaces.Space[Any]) -> None:
        self.space = space
        self._shape: tuple[int, ...] = space.shape or ()
        self._is_discrete, self._is_box = isinstance(space, spaces.Discrete), isinstance(space, spaces.Box)
        low, high = _limits(space)
        self._indices = range(int(low), int(high) + 1) if self._is_discrete else range(0)
        self._low, self._high = np.ravel(low).astype(np.float64), np.ravel(high).astype(np.float64)

    def batch(self, actions: Any, num_envs: int) -> Array:
        """The actions (B, ...) of a batch.

        Raises:
            ValueError: a wrong shape, something that is no (whole) number, NaN, infinity, or an index out of range.
        """
        array = self._array(actions)
        if array.shape != (num_envs, *self._shape):
            expected = (num_envs, *self._shape)
            raise ValueError(f"actions of shape {expected} were expected for {self.space}, got shape {array.shape}")
        return self._read(array)

    def single(self, action: Any) -> Array:
        """The action of one environment as a batch (1, ...).

        Raises:
            ValueError: see `batch`.
        """
        if self._is_discrete and isinstance(action, (int, np.integer)) and int(action) in self._indices:
            return np.array([int(action)], np.int64)  # the common case, in a tenth of the time
        array = self._array(action)
        if array.shape != self._shape:
            raise ValueError(f"an action of shape {self._shape} was expected for {self.space}, got shape {array.shape}")
        return self._read(array[np.newaxis])

    def _array(self, actions: Any) -> Array:
        try:
            return np.asarray(actions)
        except (ValueError, TypeError, RecursionError) as error:
            rows = f"rows of one length were expected for {self.space}, got {shown(actions, SHOWN)}"
            raise ValueError(rows) from error

    def _read(self, array: Array) -> Array:
        if array.dtype == INT64 and not self._is_box:  # the common case, in half the time
            if _are_integers(array if array.ndim == 2 else _rows(array), self._low, self._high):
                return array.copy()
        elif array.dtype.kind not in "fiu":
            raise ValueError(f"numbers were expected for {self.space}, got dtype {array.dtype}")
        values = np.empty(array.shape)
        values[...] = array
        rows = _rows(values)
        if self._is_box:
            if not _clip(rows, self._low, self._high):
                raise ValueError(f"an action is not finite; {self.space} takes finite numbers")
            return values
        if not _are_indices(rows, self._low, self._high):
            raise ValueError(f"an action is no whole number inside {self.space}: {array.tolist()}")
        return values.astype(np.int64)


def _rows(array: Array) -> Array:
    return array if array.ndim == 2 else array.reshape(len(array), -1)


def _limits(space: Any) -> tuple[Any, Any]:
    if isinstance(space, spaces.Box):
        return space.low, space.high
    counts = space.n if isinstance(space, spaces.Discrete) else space.nvec
    return space.start, space.start + counts - 1


@kernel
def _clip(values: FloatArray, low: FloatArray, high: FloatArray) -> bool:
    """Limit values (B, k) to [low, high] in place; False where one is not finite."""
    finite = True
    for b in range(values.shape[0]):
        for entry in range(values.shape[1]):
            value = values[b, entry]
            finite &= np.isfinite(value)
            values[b, entry] = min(max(value, low[entry]), high[entry])
    return finite


@kernel
def _are_indices(values: FloatArray, low: FloatArray, high: FloatArray) -> bool:
    """Whether the values (B, k) are whole numbers in [low, high]."""
    for b in range(values.shape[0]):
        for entry in range(values.shape[1]):
            value = values[b, entry]
            if not (low[entry] <= value <= high[entry] and value == np.floor(value)):
                return False
    return True


@kernel
def _are_integers(values: IntArray, low: FloatArray, high: FloatArray) -> bool:
    """Whether the integers (B, k) lie in [low, high]."""
    for b in range(values.shape[0]):
        for entry in range(values.shape[1]):
            if not low[entry] <= values[b, entry] <= high[entry]:
                return False
    return True


def choices_of(space: spaces.Space[Any]) -> tuple[int, ...]:
    """How many values each entry of a discrete action has; empty for continuous ones."""
    if isinstance(space, spaces.Discrete):
        return (int(space.n),)
    return tuple(int(count) for count in np.ravel(getattr(space, "nvec", ())))


def flattened(space: spaces.Space[Any]) -> spaces.Discrete:
    """The discrete space in which one number stands for all entries of an action, the last entry counting fastest.

    Raises:
        ConfigurationError: the actions are continuous, or there are more than `MOST_FLAT`.
    """
    choices = choices_of(space)
    if not choices:
        raise ConfigurationError(f"flat=True is for discrete actions: {space} has continuous ones, leave it out")
    count = math.prod(choices)
    if count > MOST_FLAT:
        most = f"flat=True makes one action of each combination, at most {MOST_FLAT:,}"
        raise ConfigurationError(f"{most}: {space} has {count:,}. Leave it out, or choose another adapter")
    return spaces.Discrete(count)


def unflattened(actions: Array, choices: Sequence[int]) -> IntArray:
    """Entries (n, k) of actions (n,) of the flattened space."""
    return np.stack(np.unravel_index(actions, tuple(choices)), axis=-1).astype(np.int64)


def flat_masks(masks: BoolArray, choices: Sequence[int]) -> BoolArray:
    """Legal actions (n, prod) of the flattened space, from those of each entry side by side (n, sum)."""
    legal = np.ones((len(masks), 1), np.bool_)
    for part in np.split(masks, np.cumsum(choices)[:-1], axis=1):
        legal = (legal[:, :, np.newaxis] & part[:, np.newaxis]).reshape(len(masks), -1)
    return legal
