"""Between levels and an attacker's actions, in both forms that the environments take."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cps_envs.core.kernels import kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.fields import is_drawn
from cps_envs.fdi.legality import legal_levels
from cps_envs.fdi.memory import (
    BLOCKS_PER_VEHICLE,
    constants_of,
    matrices_of,
    memory_of,
    pack_constants,
    pack_matrices,
    update_law,
)

Pick = Callable[[int, IntArray, IntArray], IntArray]  # slot, lowest and highest legal levels (B,) -> levels (B,)


class ActionForm:
    """The S slots of an action: one for each attacked sensor, or for every sensor where tasks are drawn.

    Slots choose in their order, and what the earlier ones took narrows the interval of the later ones.
    """

    def __init__(self, config: FdiConfig) -> None:
        n = config.num_vehicles
        attacked = config.fixed_task.sensors.flags(n)
        self.sensors: IntArray = np.arange(2 * n) if is_drawn(config) else np.flatnonzero(attacked)  # (S,) readings
        self.bounds: IntArray = np.where(self.sensors < n, config.range_levels, config.rate_levels)  # (S,) levels
        self.share_levels = config.share_levels if config.attack_action == "share" else 0
        self._packed, self._stacked = pack_constants(config), pack_matrices(config)
        resolution = np.where(self.sensors < n, config.range_resolution_m, config.rate_resolution_mps)
        self._transition = config.model.transition
        self._effect = config.model.injection[:, self.sensors] * resolution

    def to_actions(
        self,
        error: FloatArray,
        attacked: BoolArray,
        pick: Pick,
        *,
        legal: bool = True,
        action_masks: BoolArray | None = None,
    ) -> tuple[IntArray, IntArray]:
        """Actions (B, S) and the levels (B, S) that they inject in states with the error (B, 2n).

        Args:
            error: true e, m and m/s.
            attacked: (B, S) slots that count; the others inject nothing.
            pick: chooses the levels of a slot once its legal interval is known.
            legal: replace a level that would end the episode by the nearest legal one; nothing in a dead end.
            action_masks: of the environment, which knows what is legal to the last digit.
        """
        offered = None if action_masks is None or self.share_levels else self._offered(action_masks)
        levels, actions = np.zeros(attacked.shape, np.int64), np.zeros(attacked.shape, np.int64)
        for slot in range(len(self.sensors)):
            low, high = self._interval(error, attacked, levels, slot, offered)
            wish = pick(slot, low, high)
            if legal:
                wish = np.clip(wish, low, high)
            wish = np.where(attacked[:, slot], np.clip(wish, -self.bounds[slot], self.bounds[slot]), 0)
            if self.share_levels:
                actions[:, slot], levels[:, slot] = to_shares(wish, low, high, self.share_levels)
            else:
                actions[:, slot], levels[:, slot] = wish + self.bounds[slot], wish
        return actions, levels

    def to_levels(self, error: FloatArray, attacked: BoolArray, actions: IntArray) -> IntArray:
        """The levels (B, S) that actions (B, S) ask for."""
        if not self.share_levels:
            return np.where(attacked, actions - self.bounds, 0)
        levels = np.zeros(attacked.shape, np.int64)
        for slot in range(len(self.sensors)):
            low, high = self._interval(error, attacked, levels, slot, None)
            acts = attacked[:, slot] & (actions[:, slot] > 0)
            levels[:, slot] = np.where(acts, _said(actions[:, slot], low, high, self.share_levels), 0)
        return levels

    def sayable(self, low: IntArray, high: IntArray) -> IntArray:
        """The levels (B, share_levels + 1) that the form "share" can say where the interval (B,) is legal."""
        actions = np.arange(self.share_levels + 1)
        said = _said(actions, low[:, np.newaxis], high[:, np.newaxis], self.share_levels)
        return np.where(actions > 0, said, 0)

    def error_after(self, error: FloatArray, levels: IntArray) -> FloatArray:
        """The error (2n,) one step after injecting levels (S,), (3.16): nothing clipped, disturbed or defended."""
        after: FloatArray = self._transition @ error + self._effect @ levels
        return after

    def _interval(
        self, error: FloatArray, attacked: BoolArray, levels: IntArray, slot: int, offered: IntArray | None
    ) -> tuple[IntArray, IntArray]:
        """The lowest and the highest legal level (B,) of a slot; 0 and 0 where there is none."""
        found = np.empty((len(error), 2), np.int64)
        _fill_intervals(error, np.where(attacked, self.sensors, -1), levels, slot, self._packed, self._stacked, found)
        low, high = found.T
        if offered is not None:
            low, high = np.maximum(low, offered[:, slot, 0]), np.minimum(high, offered[:, slot, 1])
        empty = low > high
        return np.where(empty, 0, low), np.where(empty, 0, high)

    def _offered(self, masks: BoolArray) -> IntArray:
        """The intervals (B, S, 2) that masks over the flattened action leave."""
        parts = np.split(masks, np.cumsum(2 * self.bounds + 1)[:-1], axis=1)
        low = np.stack([np.argmax(part, axis=1) for part in parts], axis=1)
        high = np.stack([part.shape[1] - 1 - np.argmax(part[:, ::-1], axis=1) for part in parts], axis=1)
        return np.stack([low, high], axis=2) - self.bounds[:, np.newaxis]


def to_shares(levels: IntArray, low: IntArray, high: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Actions (B,) of the form "share" and the levels (B,) that they inject: the nearest that this form can say.

    It says every legal level where there are at most `count` of them.
    """
    part = np.clip((levels - low) / np.maximum(high - low, 1), 0, 1)
    action = 1 + np.rint(part * (count - 1)).astype(np.int64)
    nothing = levels == 0
    return np.where(nothing, 0, action), np.where(nothing, 0, _said(action, low, high, count))


def _said(action: IntArray, low: IntArray, high: IntArray, count: int) -> IntArray:
    """The levels (B,) behind the actions 1..count, as in `choice.choose_levels`."""
    part = (action - 1) / (count - 1)
    levels: IntArray = low + np.floor(part * (high - low) + 0.5).astype(np.int64)
    return levels


@kernel
def _fill_intervals(
    errors: FloatArray,
    sensors: IntArray,
    levels: IntArray,
    slot: int,
    packed: FloatArray,
    stacked: FloatArray,
    found: IntArray,
) -> None:
    """Fill the legal intervals (B, 2) of a slot, where `levels` (B, S) of the slots before it are taken.

    `sensors` (B, S) are readings, -1 where not attacked; see `episode` for the packed constants and stacked matrices.
    """
    c, m = constants_of(packed), matrices_of(stacked)
    slots = sensors.shape[1]
    memory = memory_of(np.zeros((1, BLOCKS_PER_VEHICLE * (errors.shape[1] // 2))), 0)
    interval, row = np.empty((slots, 2), np.int64), np.empty(slots)
    for b in range(len(errors)):
        memory.error[:] = errors[b]
        update_law(memory, m)
        legal_levels(memory, c, m, sensors[b], levels[b], slot, interval, row)
        found[b] = interval[slot]
