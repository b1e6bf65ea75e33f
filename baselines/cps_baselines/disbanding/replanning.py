"""An attacker that plans its next attack and, after each, plans anew from what it saw."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.disbanding.timed import HALF, TOLERANCE_S, count_platoons
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, State

SPEEDS_MPS = np.array([0.0, 3.0, 8.0, 20.0, 25.0, 30.0])  # of the rear half, between which plans are interpolated
GAPS_M = np.array([10.0, 17.0])  # the smallest between platoons then, between which they are too: near and far
LAGS_S = np.array([0.1, 0.3, 0.5])  # between which the plans of an undefended road are interpolated
PASSED_S = 38.0  # after the first attack: by then the wave has reached the rear
FLOWING_MPS = 15.0  # of the rear half, from which on small gaps are no jam


class Numbers(NamedTuple):
    """The numbers that decide when each attack comes; each an array with one entry per episode, (B,), or (1,) for all.

    The last attack comes at `last_*`, by what the rear half drives when the attacker looks, and by how near intact
    platoons are to those ahead. On a road that nobody defends the second attack comes `second_*` after the first. The
    third comes when a part `third_*` of the time left till the last has passed; three names say 1, 3, 5 for a lag of
    0.1, 0.3, 0.5 s. On other roads, and with more attacks, the time that is left is parted equally.
    """

    look_s: FloatArray  # after the first attack
    last_0_lag_1: FloatArray  # s; the rear half stands: nobody defends
    last_0_lag_3: FloatArray
    last_0_lag_5: FloatArray
    last_3: FloatArray  # s; it drives at 3 m/s, and so on
    last_8: FloatArray
    last_20: FloatArray
    last_25_near: FloatArray
    last_25_far: FloatArray
    last_30_near: FloatArray
    last_30_far: FloatArray
    last_per_attack: FloatArray  # s for each attack of the budget beyond two, undefended
    second_lag_1: FloatArray  # s after the first attack, undefended, where it is not the last
    second_lag_3: FloatArray
    second_lag_5: FloatArray
    third_lag_1: FloatArray  # part of the time left, undefended, where it is not the last
    third_lag_3: FloatArray
    third_lag_5: FloatArray
    close_m: FloatArray  # between two platoons: a defender with a smaller such gap, once the wave has passed,
    close_last: FloatArray  # s; brings all close together: this is when the last attack comes, looked or not


class Replanning(AnalyticPolicy):
    """Disbands the front platoon at once, then the ones behind it, by plans that `numbers` describes.

    Until it has looked it plans as if nobody defended. Its last attack waits until it has looked, but for a defender
    that brings platoons close together. Plans that were searched on grids take the platoons in this order: to pass one
    over loses.
    """

    def __init__(self, spec: RoleSpec, numbers: Numbers) -> None:
        super().__init__(spec)
        self.numbers = numbers

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Whether it has looked, the rear half's speed and the smallest gap then, whether any was close, (B,) each."""
        episodes = len(generators)
        return np.zeros(episodes, np.bool_), np.zeros(episodes), np.zeros(episodes), np.zeros(episodes, np.bool_)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Platoon to disband, or 0, for each episode (B,)."""
        disbanded = seen["disbanded"] > HALF
        present = count_platoons(seen, disbanded)
        looked, speed, gap_m, close = state = self._look(seen, state, disbanded, present)
        attacks, left = disbanded.sum(axis=1), np.rint(seen["budget_left"])
        due_s = self._due_s(seen, speed, gap_m, close, disbanded)
        later = (seen["time_s"] >= due_s - TOLERANCE_S) & (looked | close | (left > 1))
        wanted = (left > 0) & np.where(attacks == 0, True, later)
        return np.where(wanted, _target(disbanded, present), 0), state

    def _look(
        self, seen: Seen, state: tuple[Array, ...], disbanded: BoolArray, present: IntArray
    ) -> tuple[BoolArray, FloatArray, FloatArray, BoolArray]:
        """The state after this decision."""
        looked, speed, gap_m, close = state
        places = np.arange(disbanded.shape[1])
        rear = places < (present // 2)[:, np.newaxis]
        rear_mps = np.where(rear, seen["mean_speed"], 0.0).sum(axis=1) / np.maximum(rear.sum(axis=1), 1)
        follows = ~disbanded[:, :-1] & (places[1:] < present[:, np.newaxis])  # an intact platoon that has one ahead
        least_m = np.where(follows, seen["leader_gap"], np.inf).min(axis=1)
        since_s = np.where(disbanded, seen["since_disbanding_s"], -np.inf).max(axis=1)
        looks = ~looked & (since_s >= np.rint(self.numbers.look_s) - TOLERANCE_S)
        passed = ~looked & (since_s >= PASSED_S - TOLERANCE_S)
        crowded = passed & (rear_mps > FLOWING_MPS) & (least_m < self.numbers.close_m)
        return looked | looks, np.where(looks, rear_mps, speed), np.where(looks, least_m, gap_m), close | crowded

    def _due_s(
        self, seen: Seen, speed: FloatArray, gap_m: FloatArray, close: BoolArray, disbanded: BoolArray
    ) -> FloatArray:
        """When the next attack comes (B,), s."""
        it, lag = self.numbers, _weights(seen["tau_s"], LAGS_S)
        attacks, left = disbanded.sum(axis=1), np.maximum(np.rint(seen["budget_left"]), 1)
        undefended = np.clip(1.0 - speed / SPEEDS_MPS[1], 0.0, 1.0)
        alone_s = _mixed(lag, it.last_0_lag_1, it.last_0_lag_3, it.last_0_lag_5)
        alone_s = alone_s + it.last_per_attack * np.maximum(attacks + left - 2, 0)
        by_speed, by_gap = _weights(speed, SPEEDS_MPS), _weights(gap_m, GAPS_M)
        last_25 = _mixed(by_gap, it.last_25_near, it.last_25_far)
        last_30 = _mixed(by_gap, it.last_30_near, it.last_30_far)
        last_s = _mixed(by_speed, alone_s, it.last_3, it.last_8, it.last_20, last_25, last_30)
        last_s = np.where(close, it.close_last, last_s)
        since_s = np.where(disbanded, seen["since_disbanding_s"], np.inf).min(axis=1)
        before_s = np.maximum(seen["time_s"] - since_s, 0.0)  # before the first attack nobody asks
        left_s = np.maximum(last_s - before_s, 0.0)
        second_s = np.minimum(_mixed(lag, it.second_lag_1, it.second_lag_3, it.second_lag_5), left_s)
        third_s = np.clip(_mixed(lag, it.third_lag_1, it.third_lag_3, it.third_lag_5), 0.0, 1.0) * left_s
        equal_s = left_s / left
        alone_s = np.where(attacks == 1, second_s, np.where(attacks == 2, third_s, equal_s))
        wait_s = np.where(left == 1, left_s, undefended * alone_s + (1.0 - undefended) * equal_s)
        due_s: FloatArray = before_s + wait_s
        return due_s


def _weights(value: FloatArray, places: FloatArray) -> FloatArray:
    """Of `places` (P,) in a linear interpolation at `value` (B,): (B, P)."""
    corners = np.eye(len(places))
    return np.stack([np.interp(value, places, corner) for corner in corners], axis=1)


def _mixed(weights: FloatArray, *values: FloatArray) -> FloatArray:
    """The sum (B,) of values, each (B,) or (1,), by weights (B, P)."""
    mixed: FloatArray = (np.stack(np.broadcast_arrays(*values), axis=1) * weights).sum(axis=1)
    return mixed


def _target(disbanded: BoolArray, present: IntArray) -> IntArray:
    """The platoon behind the rearmost one attacked, at first the front one, (B,)."""
    return np.where(disbanded.any(axis=1), disbanded.argmax(axis=1), present)
