"""The Kalman filters that a configuration offers, by the sensors that they use, and how noisy innovations are."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets


class FilterChoices:
    """How a defender names the filter that it wants.

    Raises:
        ConfigurationError: the configuration offers none.
    """

    def __init__(self, config: HvacConfig) -> None:
        sets = filter_sets(config)
        if not sets:
            raise ConfigurationError("no Kalman filters are offered here: set kalman_filters=true")
        self.member: BoolArray = membership(config, sets)  # (F, S)
        self.size: IntArray = self.member.sum(axis=1)
        self._model = len(sensor_sets(config)) + 1

    def index_of(self, wanted: BoolArray) -> IntArray:
        """The filter (B,) that uses the most of the wanted sensors (B, S) and no other."""
        fits = ~(self.member & ~wanted[:, np.newaxis]).any(axis=2)
        index: IntArray = np.where(fits, self.size, -1).argmax(axis=1)
        return index

    def choices(self, index: IntArray, seen: Seen) -> IntArray:
        """The defender's choices (B,) that name the filters of this index; the model until the window is full."""
        chosen: IntArray = np.where(seen["ready"] > 0.5, self._model + 1 + index, self._model)
        return chosen

    def of_last_choice(self, seen: Seen, otherwise: int) -> IntArray:
        """The filter (B,) that the defender followed last; `otherwise` where it followed none, or this is hidden."""
        if seen["last_choice"].shape[1] == 0:
            return np.full(len(seen), otherwise)
        last = seen["last_choice"].argmax(axis=1) - self._model - 1
        index: IntArray = np.where(last >= 0, last, otherwise)
        return index


# Forged readings without noise are smoother than a sensor can be.
MEMORY_STEPS = 30.0  # of the mean square: an hour
MOST = 9.0  # of a square, so that one large innovation is forgotten within hours


def spread_after(spread: FloatArray, innovation: FloatArray) -> FloatArray:
    """The exponentially weighted mean square of innovations in standard deviations, any shape, with the newest one.

    That of an honest sensor is 1 +- 0.18; below 0.35 it is seldom.
    """
    square = innovation * innovation
    square[square > MOST] = MOST
    renewed: FloatArray = spread + (square - spread) / MEMORY_STEPS
    return renewed
