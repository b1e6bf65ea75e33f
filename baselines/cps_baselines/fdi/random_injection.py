"""Random injections, legal as far as one step shows: the attackers that every other one has to beat."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.action_form import Form, interval_of, new_slots, open_slots, take
from cps_baselines.fdi.injection import InjectionPolicy, look, new_view
from cps_envs.core.compute.generators import streams_of
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, kernel, lend, unpack
from cps_envs.core.compute.streams import jumps, skip, uniform
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.state import Constants


class RandomInjection(InjectionPolicy):
    """Injects a random legal level into every attacked sensor.

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
        self._held = hold(Choice(self.largest, jumps(2 * len(self.form.sensors), self.config.horizon)))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Streams (B, 4) of numbers, two for each slot and step: for the level and for keeping it; no level yet."""
        return streams_of(generators), np.zeros((len(generators), len(self.form.sensors)), np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """See the class."""
        own, last = state
        actions, taken, form = np.empty_like(last), last.copy(), self.form
        masks = form.masks(seen.masks, len(last))
        _draw(form.held, self._held, seen.observation, masks, own, self.stickiness, self.extremes, taken, actions)
        return actions, (own, taken)


class Choice(NamedTuple):
    """The levels that a random attacker draws from, and the random numbers for it."""

    largest: IntArray  # (S,) bounds of |level|
    jumps: Array  # (horizon, 4) from the start of a stream to the numbers of a step


@kernel
def _draw(
    form: Form,
    choice: Choice,
    observation: Observation,
    masks: BoolArray,
    own: Array,
    stickiness: float,
    extremes: bool,
    taken: IntArray,
    actions: IntArray,
) -> None:
    """Fill the actions (B, S) for observations (B, size).

    `taken` (B, S) is what was taken in the last step, and then in this one: with `extremes` sides, 0 = lowest, else
    levels. `own` (B, 4) are the streams.
    """
    c, n = unpack(Constants, form.constants, 0), form.matrices.step.shape[1] // 2
    new, shown, place, largest = new_slots(form, n), new_view(form, n), np.empty(4, np.uint64), choice.largest
    for b in range(actions.shape[0]):
        episode = lend(shown)
        look(form, c, borrowed(observation)[b], episode)
        slots, step = open_slots(form, episode.attacked, new), episode.step[0]
        skip(borrowed(own)[b], borrowed(choice.jumps)[max(0, min(step, c.horizon - 1))], borrowed(place))
        for slot in range(form.sensors.size):
            low, high = interval_of(form, c, episode.error, slots, slot, borrowed(masks)[b])
            lowest = min(max(low, -largest[slot]), high)
            highest = max(min(high, largest[slot]), lowest)
            number, keep = uniform(borrowed(place)), uniform(borrowed(place))
            if not (keep < stickiness and step > 0):
                choices = 2 if extremes else highest - lowest + 1
                drawn = math.floor(number * choices)
                taken[b, slot] = drawn if extremes else lowest + drawn
            wish = taken[b, slot]
            if extremes:
                wish = highest if wish > 0 else lowest
            wish = min(max(min(max(wish, lowest), highest), low), high)
            actions[b, slot] = take(form, slots, slot, wish)


def bang_bang(spec: RoleSpec, stickiness: float = 0.8) -> RandomInjection:
    """Alternates full braking and full acceleration at random. It is strong, although it knows no target."""
    return RandomInjection(spec, stickiness=stickiness, extremes=True)
