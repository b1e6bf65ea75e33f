"""Days under the same settings, one per seed, simulated side by side, and what became of them.

Some have their course kept, for the figures and for claims about what happens when.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets

Settings = tuple[tuple[str, Hashable], ...]  # fields of the configuration that differ from the preset "paper"
Watch = Callable[[HvacGame], None]
CALL_S, LANE_S, SET_S = 150e-6, 9e-6, 0.2e-6  # roughly what a step costs: anyway, per day, per day and sensor set


@dataclass(frozen=True)
class DayOutcome:
    """What B days of K steps in a building of n zones ended with."""

    squared_error: FloatArray  # (K, B) C2, |x(k) - x_r|^2 summed over zones
    mean_abs_error_c: FloatArray  # (B, n) over the whole day
    onset_step: int
    distinct_sets: IntArray  # (B,) sensor sets chosen at some time
    intact_sets: IntArray  # (B,) of these, those without an attacked sensor
    model_steps: IntArray  # (B,) in which the model's prediction was chosen
    rejecting_steps: IntArray  # (B,) in which no set passed the threshold of MTD2
    full_window_steps: int  # in which a set could be chosen

    @property
    def a_impact(self) -> FloatArray:
        """A_impact (4.19) of each day, (B,) C2, from the onset on."""
        return self.impact_from(self.onset_step)

    def impact_from(self, step: int) -> FloatArray:
        """The mean of the squared error over the states from `step` on, (B,) C2."""
        impact: FloatArray = self.squared_error[step:].mean(axis=0)
        return impact


@dataclass(frozen=True)
class DayScenario:
    """B days that differ by their seed only; an experiment of the chapter."""

    attacker: str = "none"  # names of policies
    defender: str = "none"
    days: int = 1  # B
    settings: Settings = ()
    first_seed: int = 0  # of B in a row

    @property
    def config(self) -> HvacConfig:
        """The configuration that it shares with the environments."""
        config: HvacConfig = HVAC.config("paper", dict(self.settings))
        return config

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        config = self.config
        env_s = LANE_S + (0.0 if self.defender == "none" else SET_S * len(sensor_sets(config)))
        return config.num_steps * (CALL_S + env_s * self.days)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        config = self.config
        attacked = "" if self.attacker == "none" else f" on {config.max_compromised} of {config.num_sensors}"
        return f"{self.attacker}{attacked}, {self.defender}"

    def play(self, watch: Watch) -> HvacGame:
        """Simulate all days; `watch` is called with the game at k = 0 and after every step."""
        envs = np.ones(self.days, np.bool_)
        match = HVAC.match(self.config, self.days, {"attacker": self.attacker, "defender": self.defender})
        game = match.game
        assert isinstance(game, HvacGame)
        match.reset(envs, [np.random.default_rng(self.first_seed + day) for day in range(self.days)])
        watch(game)
        for _ in range(game.horizon):
            match.step({}, envs, 1)
            watch(game)
        return game

    def run(self) -> DayOutcome:
        """Simulate them to the end."""
        squares: list[FloatArray] = []
        game = self.play(lambda game: squares.append(squared_error(game)))
        metrics = {name: values.astype(np.int64) for name, values in game.metrics().items()}
        return DayOutcome(
            squared_error=np.array(squares),
            mean_abs_error_c=game.state.absolute_error / game.config.num_steps,
            onset_step=int(game.state.onset[0]),
            distinct_sets=metrics["distinct_sets"],
            intact_sets=(used_sets(game) & ~self._flawed(game)).sum(axis=1),
            model_steps=metrics["model_steps"],
            rejecting_steps=metrics["rejecting_steps"],
            full_window_steps=game.horizon - game.config.window_steps,
        )

    def _flawed(self, game: HvacGame) -> BoolArray:
        """Which sets use a sensor that is attacked, (B, sets)."""
        attacked = game.state.compromised & (self.attacker != "none")
        marked: BoolArray = np.any(game.constants.member & attacked[:, np.newaxis], axis=2)
        return marked


def used_sets(game: HvacGame) -> BoolArray:
    """Which sets were chosen at some time, (B, sets): the first choices after the raw readings."""
    used: BoolArray = game.state.used[:, 1 : 1 + len(game.constants.member)]
    return used


def squared_error(game: HvacGame) -> FloatArray:
    """|x(k) - x_r|^2 (B,), C2, at the state that the game is in."""
    error: FloatArray = ((game.state.temperature - game.config.reference_c) ** 2).sum(axis=1)
    return error


class DayCourse(NamedTuple):
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
class RecordedDay:
    """A scenario whose course is kept; an experiment of the chapter."""

    scenario: DayScenario

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return self.scenario.cost

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.scenario.label}, recorded"

    def run(self) -> DayCourse:
        """Simulate it to the end."""
        before: list[tuple[Array, ...]] = []  # at k
        after: list[tuple[Array, ...]] = []  # decided at k, known at k + 1

        def watch(game: HvacGame) -> None:
            state = game.state
            before.append(tuple(each.copy() for each in (state.temperature, state.reading, state.residual)))
            after.append(tuple(each.copy() for each in (state.fed, state.heating, state.choice)))

        game = self.scenario.play(watch)
        config = game.config
        return DayCourse(
            config,
            np.arange(config.num_steps, dtype=np.float64) * (config.step_s / 3600.0),
            game.constants.outdoor[: config.num_steps].copy(),
            *(np.array(each) for each in zip(*before, strict=True)),
            *(np.array(each) for each in zip(*after[1:], strict=True)),
        )
