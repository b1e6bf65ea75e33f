"""Moving target defences: a set of sensors at random among those whose readings fit the model, anew at every step."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.hvac.seen import Clock
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.hvac.kernel import kernel
from cps_envs.hvac.sensors import sensor_sets

FALLBACKS = ("least_mean", "model")


class MovingTarget(AnalyticPolicy):
    """Base: each eligible set with the same probability; until the window is full, the least squares of all sensors."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._sets = len(sensor_sets(spec.config))
        self._ready = spec.fields.slices["ready"].start
        self._clock = Clock(spec)

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Uniform numbers (B, K), one for each step."""
        return (np.stack([generator.random(self.spec.config.num_steps) for generator in generators]),)

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Choices (B,)."""
        if state is None:
            state = self.begin([np.random.default_rng() for _ in observation], [{}] * len(observation))
        assert state is not None
        drawn, fallback = np.empty(len(observation), np.int64), self.fallback(observation)
        draw_marked(self.eligible(observation), state[0], self._clock(observation), fallback, drawn)
        return np.where(observation[:, self._ready] > 0, drawn + 1, self._sets + 1), state

    @abstractmethod
    def eligible(self, observation: Array) -> BoolArray:
        """The sets to draw from, (B, sets)."""

    def fallback(self, observation: Array) -> IntArray:
        """What to take where no set is eligible, (B,), counted from 0; the number of sets means the model."""
        return np.full(len(observation), self._sets)


class Mtd1(MovingTarget):
    """MTD1, Algorithm 3: ranks the sets by their newest residual J_a (4.32) and draws from the better half."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._better = spec.fields.slices["better_half"]

    def eligible(self, observation: Array) -> BoolArray:
        """The better half."""
        half: BoolArray = observation[:, self._better] > 0
        return half


class Mtd2(MovingTarget):
    """MTD2, Algorithm 4: draws among the sets whose mean residual Jm_a since k_0 (4.33) is at most eps.

    The algorithm draws sets without replacement until two are found that pass, and takes either; that gives each set
    that passes the same probability. Where none passes, `fallback="least_mean"` takes the set with the smallest mean,
    and `fallback="model"` the model's prediction (the paper leaves this open).

    `threshold_c2` replaces the configuration's eps; means are then compared in the precision of the observation, a
    relative 1e-6.

    Raises:
        ConfigurationError: another fallback, or a threshold that is not positive.
    """

    def __init__(self, spec: RoleSpec, *, fallback: str = "least_mean", threshold_c2: float | None = None) -> None:
        super().__init__(spec)
        if fallback not in FALLBACKS:
            raise ConfigurationError(f"fallback = {fallback!r}: choose one of {', '.join(FALLBACKS)}")
        if threshold_c2 is not None and not threshold_c2 > 0:
            raise ConfigurationError(f"threshold_c2 = {threshold_c2} must be positive")
        self.uses_model, self.threshold_c2 = fallback == "model", threshold_c2
        self._passes, self._mean = spec.fields.slices["passes"], spec.fields.slices["mean_residual"]
        if threshold_c2 is not None:
            scale = next(field for field in spec.fields if field.name == "mean_residual")
            level = np.log1p(threshold_c2 / spec.config.threshold_c2)
            self._limit = 2.0 * (level - scale.low) / (scale.high - scale.low) - 1.0

    def eligible(self, observation: Array) -> BoolArray:
        """The sets that pass."""
        if self.threshold_c2 is None:
            passes: BoolArray = observation[:, self._passes] > 0
            return passes
        below: BoolArray = observation[:, self._mean] <= self._limit
        return below

    def fallback(self, observation: Array) -> IntArray:
        """The set with the smallest mean residual, or the model."""
        if self.uses_model:
            return super().fallback(observation)
        return np.argmin(observation[:, self._mean], axis=1)


@kernel
def draw_marked(marked: BoolArray, uniform: FloatArray, step: IntArray, fallback: IntArray, out: IntArray) -> None:
    """Fill `out` (B,) with one of the marked options (B, sets) each, or the fallback (B,) where none is marked.

    `uniform` (B, K) holds a number in [0, 1) for each step; the one of `step` (B,) decides.
    """
    for b in range(len(marked)):
        left = int(uniform[b, step[b]] * marked[b].sum())
        out[b] = fallback[b]
        for a in range(marked.shape[1]):
            if marked[b, a]:
                if left == 0:
                    out[b] = a
                    break
                left -= 1
