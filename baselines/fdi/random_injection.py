"""Random injections, legal as far as one step shows: the attackers that every other one has to beat."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.fdi.action_form import Form, interval_of, new_slots, open_slots, take
from baselines.fdi.injection import InjectionPolicy, View
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import borrowed, kernel, unpack
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.state import Constants


class RandomInjection(InjectionPolicy):
    """Draws every attacked sensor's level uniformly from what is legal now.

    With probability `stickiness` a sensor keeps its level (or the nearest legal one) instead. `largest` bounds |level|.
    With `extremes` a sensor takes its lowest or its highest legal level, and what it keeps is the side; this is far
    stronger, since optimal attacks brake and then accelerate as hard as they may for most of the time.

    Raises:
        ConfigurationError: a stickiness outside 0 to 1, or a negative bound.
    """

    def __init__(
        self, spec: RoleSpec, *, stickiness: float = 0.0, largest: int | None = None, extremes: bool = False
    ) -> None:
        super().__init__(spec)
        if not 0 <= stickiness <= 1 or (largest is not None and largest < 0):
            raise ConfigurationError(
                f"random injections need stickiness from 0 to 1 and largest >= 0; got {stickiness} and {largest}"
            )
        self.stickiness, self.extremes = stickiness, extremes
        self.largest: IntArray = self.form.bounds if largest is None else np.minimum(self.form.bounds, largest)

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Draws (horizon, S, 2) of each whole episode, one for the level and one for keeping it; no level yet."""
        shape = (self.config.horizon, len(self.form.sensors), 2)
        draws = np.empty(len(generators), object)  # large, and handed on as they are
        for b, generator in enumerate(generators):
            draws[b] = generator.random(shape)
        return draws, np.zeros((len(draws), len(self.form.sensors)), np.int64)

    def choose(self, view: View, masks: BoolArray | None, state: State) -> tuple[IntArray, State]:
        """See the class."""
        assert state is not None
        draws, last = state
        actions, taken = np.empty_like(last), last.copy()
        form, masks, latest = self.form, self.form.masks(masks, len(last)), self.config.horizon - 1
        now = np.array([own[min(step, latest)] for own, step in zip(draws, view.step.tolist(), strict=True)])
        _draw(form.held, *view, masks, now, self.largest, self.stickiness, self.extremes, taken, actions)
        return actions, (draws, taken)


@kernel
def _draw(
    form: Form,
    errors: FloatArray,
    attacked: BoolArray,
    target: IntArray,
    steps: IntArray,
    masks: BoolArray,
    draws: FloatArray,
    largest: IntArray,
    stickiness: float,
    extremes: bool,
    taken: IntArray,
    actions: IntArray,
) -> None:
    """Fill the actions (B, S) of a view.

    `taken` (B, S) is what was taken in the last step, and then in this one: with `extremes` sides, 0 = lowest, else
    levels. `largest` (S,) bounds them, `draws` (B, S, 2) are in [0, 1): for the level, and for keeping it.
    """
    c, new = unpack(Constants, form.constants, 0), new_slots(form, errors.shape[1] // 2)
    for b in range(steps.size):
        slots = open_slots(form, borrowed(attacked)[b], new)
        for slot in range(form.sensors.size):
            low, high = interval_of(form, c, borrowed(errors)[b], slots, slot, borrowed(masks)[b])
            lowest = min(max(low, -largest[slot]), high)
            highest = max(min(high, largest[slot]), lowest)
            if not (draws[b, slot, 1] < stickiness and steps[b] > 0):
                choices = 2 if extremes else highest - lowest + 1
                drawn = math.floor(draws[b, slot, 0] * choices)
                taken[b, slot] = drawn if extremes else lowest + drawn
            wish = taken[b, slot]
            if extremes:
                wish = highest if wish > 0 else lowest
            wish = min(max(min(max(wish, lowest), highest), low), high)
            actions[b, slot] = take(form, slots, slot, wish, low, high)


def bang_bang(spec: RoleSpec, stickiness: float = 0.8) -> RandomInjection:
    """Full braking and full acceleration in random turns: a strong attacker that knows no target."""
    return RandomInjection(spec, stickiness=stickiness, extremes=True)
