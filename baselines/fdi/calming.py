"""Going on legally by calming down: injections just large enough that no vehicle exceeds its limits.

Where that leads legally to the end of the episode, or to a collision, continuous injections can go on legally, and no
linear program has to find it out. Where it does not, nothing is known.
"""

from __future__ import annotations

import numpy as np

from baselines.fdi.action_form import Form
from cps_envs.core.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, unpack
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.controller import feedback
from cps_envs.fdi.legality import place, resolution
from cps_envs.fdi.readings import inject
from cps_envs.fdi.state import Constants, Scratch, add_product, new_scratch


@kernel
def find_examples(
    form: Form,
    errors: FloatArray,
    attacked: BoolArray,
    steps: IntArray,
    levels: IntArray,
    found: BoolArray,
) -> None:
    """Fill the episodes (B,) that can go on legally, as far as this shows, after injecting levels (B, S).

    `errors` (B, 2n) are those before, `attacked` (B, S) the slots that count, `steps` (B,) those done.
    """
    c, new = unpack(Constants, form.constants, 0), new_scratch(errors.shape[1] // 2, levels.shape[1])
    error, sensors = np.empty(errors.shape[1]), np.empty(levels.shape[1], np.int64)
    for b in range(found.size):
        s = lend(new)
        for slot in range(sensors.size):
            sensors[slot] = form.sensors[slot] if attacked[b, slot] else -1
        place(borrowed(sensors), s.slot)
        copy(borrowed(errors)[b], borrowed(error))
        inject(s.offset, c, borrowed(sensors), borrowed(levels)[b])
        move(form, borrowed(error), s)
        found[b] = True
        for _ in range(steps[b] + 1, c.horizon):
            if has_collided(borrowed(error), c):
                break
            if not calm(borrowed(error), c, s):
                found[b] = False
                break
            move(form, borrowed(error), s)


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
