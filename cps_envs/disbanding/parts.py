"""What learners defend through: the parts of a follower, each at one of three levels, on top of the platoons' law."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import record_type
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, State
from cps_envs.disbanding.adapters import Follow
from cps_envs.disbanding.follower import LEADERS, SetPoints, follow_all

LAW = SetPoints(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0)  # the platoon's own law, no correction
COMMAND = 2 / 3  # of the record: gain of its vehicle's command, as a share of that of its speed
# Levels of each part. The middle one is neutral, the last one a textbook's (`follower.LEADERS`), and the first one a
# quarter of that with the wrong sign: as strong as the right one, it would make random play three times as bad as none.
WEAK = -0.25
LEVELS: FloatArray = np.array(
    [
        [WEAK * LEADERS.predecessor, 0.0, LEADERS.predecessor],
        [WEAK * LEADERS.closing, 0.0, LEADERS.closing],  # 1/s
        [WEAK * LEADERS.gap, 0.0, LEADERS.gap],  # 1/s2
        [WEAK * 0.3, 0.0, 0.3],  # 1/s, of the record's speed
        [1.25, 1.0, 0.3],  # share of the plain law; with the last one the actuator's lag is made up for
    ]
)
NEUTRAL = 1


class PartsRoad(Follow):
    """One agent that adds parts of a follower to the law of all platoons: each with a wrong sign, not at all, or fully.

    The parts: the predecessor's acceleration, the closing speed, room, the record of a disbanded vehicle, and how much
    of the plain law remains. Wanted gap and leaders' headway are a textbook's. With the middle level of all parts the
    platoons drive by their own law. No level of a single part is a follower.
    """

    shared = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.action_space = spaces.MultiDiscrete([LEVELS.shape[1]] * len(LEVELS))
        self.neutral_action = np.full(len(LEVELS), NEUTRAL)

    def observe(self, seen: Seen, state: State) -> Observation:
        """The means and extremes over the intact platoons, (B, 1, size), see `platoons.road_fields`."""
        return self._rows.observe_road(seen.observation)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Always, (B, 1)."""
        return np.ones((len(seen), 1), np.bool_)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The corrections (B, M); exactly zero where all parts are neutral."""
        corrections = np.zeros((len(seen), self.spec.config.max_vehicles))
        follow_all(seen.observation, self._layout, points_of(actions), *self._road, corrections)
        neutral = (actions[:, 0] == NEUTRAL).all(axis=1)
        return np.where(neutral[:, np.newaxis], 0.0, corrections), state


def points_of(actions: Array) -> Array:
    """Records (2 B,) of `SetPoints`, leaders' and others' by turns, of actions (B, 1, 5)."""
    chosen = LEVELS[np.arange(len(LEVELS)), actions[:, 0].astype(np.int64)]
    values = np.empty((len(chosen), 2, len(LAW)))
    values[:] = LAW
    points: FloatArray = values.transpose(2, 0, 1)  # a view, a row for each number of `SetPoints`
    at = SetPoints._fields.index
    for name, part in (("predecessor", 0), ("closing", 1), ("gap", 2), ("ahead_closing", 3), ("law", 4)):
        points[at(name)] = chosen[:, part, np.newaxis]
    points[at("ahead_command")] = COMMAND * points[at("ahead_closing")]
    points[at("lead")] = LEADERS.lead * (actions[:, :, 4] == NEUTRAL + 1)
    points[at("wanted_m")] = LEADERS.wanted_m
    points[at("headway_s"), :, 0] = LEADERS.headway_s
    table: Array = values.reshape(-1, len(LAW)).view(record_type(SetPoints))[:, 0]
    return table
