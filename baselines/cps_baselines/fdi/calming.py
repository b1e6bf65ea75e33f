"""Going on legally by calming down: injections just large enough that no vehicle exceeds its limits.

Where that leads legally to the end of the episode, or to a collision, continuous injections can go on legally, and no
linear program has to find it out. Where it does not, nothing is known.
"""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.action_form import Form, new_slots, open_slots, read, say
from cps_baselines.fdi.injection import View, look
from cps_envs.core.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, unpack, view
from cps_envs.core.types import BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.controller import feedback
from cps_envs.fdi.legality import place, resolution
from cps_envs.fdi.readings import inject
from cps_envs.fdi.state import Constants, Scratch, add_product, new_scratch

SEEN = 1e-4  # m and m/s; how far a float32 observation may be off the state that the model gives


@kernel
def screen(
    form: Form,
    observation: Observation,
    expected: FloatArray,
    actions: IntArray,
    shows: bool,
    views: View,
    levels: IntArray,
    passed: BoolArray,
    legal: IntArray,
) -> None:
    """What a shield does about the actions (B, S) before it looks at single episodes.

    Args:
        form: of the actions.
        observation: (B, size).
        expected: (B, 2n) the errors by the model, which count where the observations bear them out.
        actions: (B, S) that are asked for.
        shows: let episodes pass of which it can be shown here that they can go on legally.
        views: is filled, with the errors that count.
        levels: (B, S) is filled with what is asked for, or what is injected where it passes.
        passed: (B,) is filled with the episodes that pass.
        legal: (B, S) is filled with the actions where they pass: the nearest legal ones.
    """
    c, n = unpack(Constants, form.constants, 0), expected.shape[1] // 2
    new, scratch, unmasked = new_slots(form, n), new_scratch(n, c.readings, actions.shape[1]), np.empty(0, np.bool_)
    error, nearest = np.empty(2 * n), np.empty(actions.shape[1], np.int64)
    for b in range(passed.size):
        episode, own, s, mask = view(views, b), borrowed(levels)[b], lend(scratch), borrowed(unmasked)
        look(form, c, borrowed(observation)[b], episode)
        correct(episode.error, borrowed(expected)[b])
        slots = open_slots(form, episode.attacked, new)
        read(form, c, episode.error, episode.attacked, slots, mask, borrowed(actions)[b], own)
        passed[b] = False
        if shows:
            say(form, c, episode.error, slots, mask, own, True, borrowed(legal)[b], borrowed(nearest))
            copy(episode.error, borrowed(error))
            inject(s.offset, c, slots.sensors, borrowed(nearest))
            place(slots.sensors, s.slot)
            move(form, borrowed(error), s)
            passed[b] = goes_on(form, c, borrowed(error), episode.step[0] + 1, s)
        if passed[b]:
            say(form, c, episode.error, slots, mask, borrowed(nearest), True, borrowed(legal)[b], own)


@inlined
def correct(seen: FloatArray, expected: FloatArray) -> None:
    """Replace an error (2n,) that was observed by the expected one, if it is near enough to that."""
    near = True
    for j in range(seen.size):
        near &= abs(seen[j] - expected[j]) < SEEN
    if near:
        copy(expected, seen)


@inlined
def goes_on(form: Form, c: Constants, error: FloatArray, step: int, s: Scratch) -> bool:
    """Whether the episode with the error (2n,) at a step can go on legally, as far as this shows."""
    for _ in range(step, c.horizon):
        if has_collided(error, c):
            return True
        if not calm(error, c, s):
            return False
        move(form, error, s)
    return True


@inlined
def calm(error: FloatArray, c: Constants, s: Scratch) -> bool:
    """Fill the injections `s.offset` (2n,) that bring all commands within their limits; False where there are none."""
    n = error.size // 2
    fill(s.offset, 0.0)
    for i in range(n):
        own = feedback(error, c, i)
        missing = clip(own, c.min_acceleration_mps2, c.max_acceleration_mps2) - own if c.limit_commands else 0.0
        if s.slot[i] >= 0 and c.limit_readings and error[i] < -c.desired_gap_m:
            return False
        if missing == 0:
            continue
        rate = missing / c.derivative_gain if c.derivative_gain > 0 else np.inf
        if s.slot[n + i] >= 0 and abs(rate) <= c.rate_levels * resolution(c, n + i, n):
            s.offset[n + i] = rate
            continue
        gap = missing / c.proportional_gain if c.proportional_gain > 0 else np.inf
        if s.slot[i] < 0 or abs(gap) > c.range_levels * resolution(c, i, n):
            return False
        if c.limit_readings and error[i] + gap < -c.desired_gap_m:
            return False
        s.offset[i] = gap
    return True


@inlined
def has_collided(error: FloatArray, c: Constants) -> bool:
    """Whether a gap has closed."""
    least = np.inf
    for i in range(error.size // 2):
        least = min(least, error[i])
    return least <= -c.desired_gap_m


@inlined
def move(form: Form, error: FloatArray, s: Scratch) -> None:
    """One step of the error (2n,) under the injections `s.offset`, (3.16)."""
    copy(error, s.error)
    fill(error, 0.0)
    add_product(form.matrices.step, 0, s.error, error)
    add_product(form.matrices.step, error.size, s.offset, error)
