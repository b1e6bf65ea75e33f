"""Lies that a filter half expects: every attacked sensor reports what is predicted plus some deviations."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray
from cps_envs.fdi.adapters.lying import Lying

LEVELS = (-2.5, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.5)  # standard deviations of an innovation; chosen


class Expected(Lying):
    """MultiDiscrete (9, 9): by how many standard deviations m attacked ranges and range-rates exceed the prediction.

    A sensor reports predicted + m deviations, as far as its resolution allows; what rounding leaves over is added to
    the next reading. Zero is no honest reading: it agrees with the filter, whose errors then grow.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, LEVELS)
        self.action_space = spaces.MultiDiscrete([len(LEVELS)] * 2)
        self.neutral_action = np.full(2, LEVELS.index(0.0))
        n, half = spec.config.num_vehicles, spec.config.num_readings // 2
        self._error = self.gaps[self.sensors] + np.where(self.ranges, 0, n)  # (S,) which of the 2n errors each shows
        self._kind = np.where(self.ranges, 0, 1)
        self._place = self.sensors % half

    def begin(self, num_envs: int) -> State:
        """What rounding left over, (B, S), m and m/s."""
        return (np.zeros((num_envs, len(self.sensors))),)

    def lies(self, seen: Seen, state: State) -> FloatArray:
        """The mean injections of the last step, into attacked ranges and into attacked range-rates."""
        return self.injected(seen)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The levels nearest to what the sensors are to report."""
        margins = self.levels[actions[:, 0]][:, self._kind]
        deviation = np.stack([seen["range_deviation"], seen["rate_deviation"]], axis=1)[:, self._kind, self._place]
        truth = np.concatenate([seen["gap_error"], seen["relative_speed"]], axis=1)
        predicted = np.concatenate([seen["predicted_gap_error"], seen["predicted_speed"]], axis=1)
        wanted = (predicted - truth)[:, self._error] + margins * deviation + state[0]
        levels, half = np.rint(wanted / self.resolution), self.resolution / 2
        lying = self.works(seen)[:, np.newaxis] & self.attacked(seen)
        return self.say(levels * lying), (np.clip(wanted - levels * self.resolution, -half, half) * lying,)
