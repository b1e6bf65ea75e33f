"""The untrained policy that training settings ask for: near the neutral action, and slow to change its mind."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.training import Training
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.types import Array, FloatArray


class Untrained:
    """Draws discrete actions from logits, with a bonus for the neutral and for the last action, and others normally."""

    def __init__(self, adapter: Adapter, training: Training, frame_skip: int) -> None:
        self.choices = choices_of(adapter.action_space)
        self.neutral = np.ravel(adapter.neutral_action)
        self.deviation = training.initial_deviation
        self.bias = neutral_logits(adapter.action_space, adapter.neutral_action, training.neutral_bias)
        interval_s = adapter.spec.decision_interval_s * frame_skip
        self.stickiness = stickiness(self.choices, training.run_s, interval_s)

    def draw(self, last: Array, masks: Array | None, generator: np.random.Generator) -> Array:
        """Actions (rows, entries) after the last ones one-hot (rows, k), zeros at first; `masks` (rows, k) or None."""
        if not self.choices:
            return self.neutral + self.deviation * generator.standard_normal((len(last), len(self.neutral)))
        logits = self.bias + self.stickiness * last + generator.gumbel(size=last.shape)
        if masks is not None:
            logits = np.where(masks, logits, -np.inf)
        ends = np.cumsum(self.choices)
        parts = [logits[:, end - count : end] for end, count in zip(ends, self.choices, strict=True)]
        return np.stack([part.argmax(axis=1) for part in parts], axis=1)


def neutral_logits(space: spaces.Space[Any], neutral: Array, bonus: float) -> FloatArray:
    """Logits (k,) that are `bonus` for the neutral value of each discrete entry, and zero else; empty for a Box."""
    parts = [
        bonus * (np.arange(count) == value) for count, value in zip(choices_of(space), np.ravel(neutral), strict=False)
    ]
    return np.concatenate([np.zeros(0), *parts])


def stickiness(choices: tuple[int, ...], run_s: float, interval_s: float) -> float:
    """What is added to the logit of the last action so that an untrained policy keeps it for `run_s` on average.

    With K equally likely values and a bonus k a run lasts 1 + e^k / (K - 1) decisions of `interval_s`. 0 where runs
    are as short as a decision anyway.
    """
    if not choices or run_s <= interval_s:
        return 0.0
    return max(math.log((max(choices) - 1) * (run_s / interval_s - 1)), 0.0)
