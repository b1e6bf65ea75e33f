"""Days with their course kept, for the figures and for claims about what happens when."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cps_baselines.hvac.reproduction.scenario import Scenario
from cps_envs.core.config import bounds
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame


class Course(NamedTuple):
    """B days of K states, K - 1 decisions between them, n zones, S sensors."""

    config: HvacConfig
    time_h: FloatArray  # (K,)
    outdoor_c: FloatArray  # (K,)
    temperature_c: FloatArray  # (K, B, n) true
    reading_c: FloatArray  # (K, B, S) forged or not
    residual_c2: FloatArray  # (K, B, sets) J_a (4.32); 0 until the window is full
    estimate_c: FloatArray  # (K - 1, B, n) that the controller got
    heating_w: FloatArray  # (K - 1, B, n)
    choice: IntArray  # (K - 1, B) 0 raw readings, 1.. sets, last the model

    @property
    def onset_step(self) -> int:
        """t_0, the same on all days."""
        return int(bounds(self.config.onset_step)[0])

    @property
    def tracking_error_c(self) -> FloatArray:
        """|x - x_r|, (K, B, n)."""
        error: FloatArray = np.abs(self.temperature_c - self.config.reference_c)
        return error

    @property
    def estimation_error_c(self) -> FloatArray:
        """|xh - x|, (K - 1, B, n)."""
        error: FloatArray = np.abs(self.estimate_c - self.temperature_c[:-1])
        return error

    @property
    def level_percent(self) -> FloatArray:
        """Heating in percent of E, (K - 1, B, n)."""
        level: FloatArray = 100.0 * self.heating_w / self.config.max_heating_w
        return level

    def between(self, first_h: float, last_h: float) -> slice:
        """The steps from one time of day to before another."""
        steps_per_h = 3600.0 / self.config.step_s
        return slice(round(first_h * steps_per_h), round(last_h * steps_per_h))


@dataclass(frozen=True)
class Recorded:
    """A scenario whose course is kept; an experiment of the chapter."""

    scenario: Scenario

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return self.scenario.cost

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.scenario.label}, recorded"

    def run(self) -> Course:
        """Simulate it to the end."""
        before: list[tuple[Array, ...]] = []  # at k
        after: list[tuple[Array, ...]] = []  # decided at k, known at k + 1

        def watch(game: HvacGame) -> None:
            state = game.state
            before.append(tuple(each.copy() for each in (state.temperature, state.reading, state.residual)))
            after.append(tuple(each.copy() for each in (state.fed, state.heating, state.choice)))

        game = self.scenario.play(watch)
        config = game.config
        return Course(
            config,
            np.arange(config.num_steps, dtype=np.float64) * (config.step_s / 3600.0),
            game.constants.outdoor[: config.num_steps].copy(),
            *(np.array(each) for each in zip(*before, strict=True)),
            *(np.array(each) for each in zip(*after[1:], strict=True)),
        )
