"""Moving target defences: a set of sensors at random among those whose readings fit the model, anew at every step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.hvac.sensors import sensor_sets

FALLBACKS = ("least_mean", "model")


class Draw(NamedTuple):
    """How to read choices off an encoded observation; the first three are places in it."""

    mark: int  # of the entries that decide, one per set
    mean: int  # of the mean residuals, one per set
    ready: int
    sets: int
    above: float  # a set is drawn from where its mark lies above this
    limit: float  # and not beyond this
    to_model: bool  # where there is no such set take the model, not the smallest mean


class MovingTarget(AnalyticPolicy):
    """Base: each eligible set with the same probability; until the window is full, the least squares of all sensors."""

    def __init__(
        self, spec: RoleSpec, mark: str, *, above: float = 0.0, limit: float = np.inf, fallback: str = "least_mean"
    ) -> None:
        super().__init__(spec)
        if fallback not in FALLBACKS:
            raise ConfigurationError(f"fallback = {fallback!r}: choose one of {', '.join(FALLBACKS)}")
        first, mean, ready = (spec.fields.slices[name].start for name in (mark, "mean_residual", "ready"))
        sets = len(sensor_sets(spec.config))
        self._draw = Draw(first, mean, ready, sets, above, limit, to_model=fallback == "model")

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Uniform numbers (B, K), one for each step, and how many are used up (B,)."""
        uniform = np.stack([generator.random(self.spec.config.num_steps) for generator in generators])
        return uniform, np.zeros(len(uniform), np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        uniform, used = state
        return draw_choices(seen.observation, uniform, used, self._draw), (uniform, used + 1)


class Mtd1(MovingTarget):
    """Ranks the sets by their newest residual J_a (4.32) and draws from the better half: MTD1, Algorithm 3."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, "better_half")


class Mtd2(MovingTarget):
    """Draws among the sets whose mean residual Jm_a since k_0 (4.33) is at most eps: MTD2, Algorithm 4.

    The algorithm draws sets without replacement until two are found that pass, and takes either; that gives each set
    that passes the same probability. Where none passes, `fallback="least_mean"` takes the set with the smallest mean,
    and `fallback="model"` the model's prediction (the paper leaves this open).

    `threshold_c2` replaces the configuration's eps; means are then compared in the precision of the observation, a
    relative 1e-6.

    Raises:
        ConfigurationError: another fallback, or a threshold that is not positive.
    """

    def __init__(self, spec: RoleSpec, *, fallback: str = "least_mean", threshold_c2: float | None = None) -> None:
        self.threshold_c2: float = spec.config.threshold_c2 if threshold_c2 is None else threshold_c2
        if not self.threshold_c2 > 0:
            raise ConfigurationError(f"threshold_c2 = {threshold_c2} must be positive")
        if threshold_c2 is None:
            super().__init__(spec, "passes", fallback=fallback)
        else:
            limit = encoded_mean(spec, threshold_c2)
            super().__init__(spec, "mean_residual", above=-np.inf, limit=limit, fallback=fallback)


def encoded_mean(spec: RoleSpec, mean_c2: float) -> float:
    """A mean residual, C2, as the defender observes it."""
    field = next(field for field in spec.fields if field.name == "mean_residual")
    level = float(np.log1p(mean_c2 / spec.config.threshold_c2))
    return (2.0 * level - field.low - field.high) / (field.high - field.low)


@kernel
def draw_choices(observation: Array, uniform: FloatArray, used: IntArray, draw: Draw) -> IntArray:
    """Choices (B,): 1..sets for a set, sets + 1 for the model, which before `ready` means the least squares.

    `uniform` (B, K) holds numbers in [0, 1); the one after the `used` (B,) first decides.
    """
    choices = np.full(len(observation), draw.sets + 1)
    for b in range(len(observation)):
        if observation[b, draw.ready] <= 0.0:
            continue
        marks = observation[b, draw.mark : draw.mark + draw.sets]
        marked = (marks > draw.above) & (marks <= draw.limit)
        count = marked.sum()
        if count == 0:
            if not draw.to_model:
                choices[b] = 1 + np.argmin(observation[b, draw.mean : draw.mean + draw.sets])
            continue
        left = int(uniform[b, used[b] % uniform.shape[1]] * count)
        choices[b] = 1 + np.flatnonzero(marked)[left]
    return choices
