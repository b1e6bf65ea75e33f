"""Between levels and an attacker's actions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, inlined, kernel, lend, unpack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import legal_in_slot, place
from cps_envs.fdi.observation import attacker_fields, is_drawn
from cps_envs.fdi.state import Constants, Matrices, Scratch, constants_of, matrices_of, new_scratch


class Form(NamedTuple):
    """The S slots of an action and the layout of an attacker's observation, as kernels need them."""

    sensors: IntArray  # (S,) readings
    bounds: IntArray  # (S,) largest levels
    target: IntArray  # (1,) index of the target vehicle of the fixed task
    offsets: Array  # (1,) where the fields of an observation begin
    scale: FloatArray  # (2, size) of their encoding
    constants: Array  # (1,) records of `state.Constants`
    matrices: Matrices


class ActionForm:
    """The S slots of an action: one for each attacked sensor, or for every sensor where tasks are drawn.

    Slots choose in their order, and what the earlier ones took narrows the interval of the later ones.
    """

    def __init__(self, config: FdiConfig) -> None:
        self.config = config
        readings, filters = config.num_readings, config.estimator == "kalman"
        attacked = config.fixed_task.sensors.flags(config.num_vehicles, rear=filters)
        self.sensors: IntArray = np.arange(readings) if is_drawn(config) else np.flatnonzero(attacked)  # (S,) readings
        ranges = self.sensors < readings // 2
        self.bounds: IntArray = np.where(ranges, config.range_levels, config.rate_levels)  # (S,) levels
        fields = attacker_fields(config)
        form = Form(
            sensors=self.sensors,
            bounds=self.bounds,
            target=np.array([config.target - 1]),
            offsets=fields.offsets,
            scale=fields.scale,
            constants=constants_of(config),
            matrices=matrices_of(config),
        )
        self.held = hold(form)  # for kernels
        self.resolution: FloatArray = np.where(ranges, config.range_resolution_m, config.rate_resolution_mps)  # (S,)
        self._transition = config.model.transition
        if not filters:  # it looks at rear sensors too
            self._effect = config.model.injection[:, self.sensors] * self.resolution

    def to_actions(
        self,
        error: FloatArray,
        attacked: BoolArray,
        wishes: IntArray,
        *,
        legal: bool = True,
        masks: BoolArray | None = None,
    ) -> tuple[IntArray, IntArray]:
        """Actions (B, S) and the levels (B, S) that they inject in states with the error (B, 2n).

        Args:
            error: true e, m and m/s.
            attacked: (B, S) slots that count; the others inject nothing.
            wishes: (B, S) the levels that are wanted.
            legal: replace a level that would end the episode by the nearest legal one; nothing in a dead end.
            masks: of the environment, which knows what is legal to the last digit, (B, k).
        """
        actions, levels = np.empty(wishes.shape, np.int64), np.empty(wishes.shape, np.int64)
        _say(self.held, error, attacked, wishes, self.masks(masks, len(error)), legal, actions, levels)
        return actions, levels

    def masks(self, masks: BoolArray | None, num_envs: int) -> BoolArray:
        """The masks that `interval_of` looks at, (B, 0) if there are none."""
        if masks is not None:
            return masks
        return np.zeros((num_envs, 0), np.bool_)

    def error_after(self, error: FloatArray, levels: IntArray) -> FloatArray:
        """The error (2n,) one step after injecting levels (S,), (3.16): nothing clipped, disturbed or defended."""
        after: FloatArray = self._transition @ error + self._effect @ levels
        return after


class Slots(NamedTuple):
    """An episode's slots while a kernel chooses their levels; one episode uses them after the other."""

    sensors: IntArray  # (S,) readings, -1 where not attacked
    s: Scratch  # `level` holds what the earlier slots took


@inlined
def new_slots(form: Form, n: int) -> Slots:
    """Slots of no episode yet."""
    readings, slots = unpack(Constants, form.constants, 0).readings, form.sensors.size
    return Slots(np.empty(slots, np.int64), new_scratch(n, readings, slots))


@inlined
def open_slots(form: Form, attacked: BoolArray, slots: Slots) -> Slots:
    """Turn to an episode in which the marked slots (S,) are attacked."""
    sensors, s = borrowed(slots.sensors), lend(slots.s)
    for slot in range(sensors.size):
        sensors[slot] = form.sensors[slot] if attacked[slot] else -1
    place(sensors, s.slot)
    return Slots(sensors, s)


@inlined
def interval_of(
    form: Form, c: Constants, error: FloatArray, slots: Slots, slot: int, mask: BoolArray
) -> tuple[int, int]:
    """The lowest and the highest legal level of a slot; 0 and 0 where there is none, or it is not attacked."""
    if slots.sensors[slot] < 0:
        return 0, 0
    legal_in_slot(error, c, slots.sensors, slot, slots.s.interval, slots.s)
    low, high = slots.s.interval[slot, 0], slots.s.interval[slot, 1]
    if mask.size > 0:
        middle = form.bounds[slot]
        if c.draws_gains:  # the mask knows those of the episode
            low, high = -middle, middle
        for before in range(slot):
            middle += 2 * form.bounds[before] + 1
        while low <= high and not mask[middle + low]:
            low += 1
        while low <= high and not mask[middle + high]:
            high -= 1
    return (0, 0) if low > high else (low, high)


@inlined
def take(form: Form, slots: Slots, slot: int, wish: int) -> int:
    """The action that injects a wished level, or the nearest that can be said, which is noted for the later slots."""
    bound = form.bounds[slot]
    slots.s.level[slot] = max(-bound, min(bound, wish)) if slots.sensors[slot] >= 0 else 0
    action: int = slots.s.level[slot] + bound
    return action


@inlined
def say(
    form: Form,
    c: Constants,
    error: FloatArray,
    slots: Slots,
    mask: BoolArray,
    wishes: IntArray,
    legal: bool,
    actions: IntArray,
    levels: IntArray,
) -> None:
    """See `ActionForm.to_actions`, of one episode whose slots are open."""
    for slot in range(wishes.size):
        low, high = interval_of(form, c, error, slots, slot, mask)
        wish = wishes[slot]
        actions[slot] = take(form, slots, slot, min(max(wish, low), high) if legal else wish)
        levels[slot] = slots.s.level[slot]


@kernel
def _say(
    form: Form,
    errors: FloatArray,
    attacked: BoolArray,
    wishes: IntArray,
    masks: BoolArray,
    legal: bool,
    actions: IntArray,
    levels: IntArray,
) -> None:
    """See `ActionForm.to_actions`."""
    c, new = unpack(Constants, form.constants, 0), new_slots(form, errors.shape[1] // 2)
    for b in range(wishes.shape[0]):
        slots, error, mask = open_slots(form, borrowed(attacked)[b], new), borrowed(errors)[b], borrowed(masks)[b]
        say(form, c, error, slots, mask, borrowed(wishes)[b], legal, borrowed(actions)[b], borrowed(levels)[b])
