"""Days under the same settings, one per seed, simulated side by side, and what became of them.

Some have their course kept, for the figures and for claims about what happens when.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Role
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

    def play(self, watch: Watch) -> DayOutcome:
        """Simulate all days; `watch` is called with the game at k = 0 and after every step."""
        squares: list[FloatArray] = []
        games: list[HvacGame] = []

        def look(game: Game) -> None:
            assert isinstance(game, HvacGame)
            squares.append(squared_error(game))
            games.append(game)
            watch(game)

        players: dict[Role, PolicyReference] = {"attacker": self.attacker, "defender": self.defender}
        seeds = range(self.first_seed, self.first_seed + self.days)
        metrics = play_episodes(HVAC, self.config, players, seeds, on_step=look)
        game = games[-1]
        used = game.state.used[:, 1 : 1 + len(game.constants.member)]  # the sets, after the raw readings
        return DayOutcome(
            squared_error=np.array(squares),
            mean_abs_error_c=game.state.absolute_error / game.config.num_steps,
            onset_step=int(game.state.onset[0]),
            distinct_sets=metrics["distinct_sets"].astype(np.int64),
            intact_sets=(used & ~self._flawed(game)).sum(axis=1),
            rejecting_steps=metrics["rejecting_steps"].astype(np.int64),
            full_window_steps=game.horizon - game.config.window_steps,
        )

    def run(self) -> DayOutcome:
        """Simulate them to the end."""
        return self.play(lambda game: None)

    def _flawed(self, game: HvacGame) -> BoolArray:
        """Which sets use a sensor that is attacked, (B, sets)."""
        attacked = game.state.compromised & (self.attacker != "none")
        marked: BoolArray = np.any(game.constants.member & attacked[:, np.newaxis], axis=2)
        return marked


def squared_error(game: HvacGame) -> FloatArray:
    """|x(k) - x_r|^2 (B,), C2, at the state that the game is in."""
    error: FloatArray = ((game.state.temperature - game.config.reference_range_c[0]) ** 2).sum(axis=1)
    return error


@dataclass(frozen=True)
class DayCourse(DayOutcome):
    """An outcome and what led to it: B days of K states, K - 1 decisions between them, n zones, S sensors."""

    config: HvacConfig
    outdoor_c: FloatArray  # (K,)
    temperature_c: FloatArray  # (K, B, n) true
    reading_c: FloatArray  # (K, B, S) forged or not
    residual_c2: FloatArray  # (K, B, sets) J_a (4.32); 0 until the window is full
    estimate_c: FloatArray  # (K - 1, B, n) that the controller got
    heating_w: FloatArray  # (K - 1, B, n)
    choice: IntArray  # (K - 1, B) 0 raw readings, 1.. sets, last the model

    @property
    def time_h(self) -> FloatArray:
        """The time of day at each state, (K,)."""
        return np.arange(len(self.outdoor_c), dtype=np.float64) * (self.config.step_s / 3600.0)

    @property
    def tracking_error_c(self) -> FloatArray:
        """|x - x_r|, (K, B, n)."""
        error: FloatArray = np.abs(self.temperature_c - self.config.reference_range_c[0])
        return error

    @property
    def estimation_error_c(self) -> FloatArray:
        """|xh - x|, (K - 1, B, n)."""
        error: FloatArray = np.abs(self.estimate_c - self.temperature_c[:-1])
        return error

    @property
    def level_percent(self) -> FloatArray:
        """Heating in percent of E, (K - 1, B, n)."""
        level: FloatArray = 100.0 * self.heating_w / self.config.heating_range_w[1]
        return level

    def between(self, first_h: float, last_h: float) -> slice:
        """The steps from one time of day to before another."""
        steps_per_h = 3600.0 / self.config.step_s
        return slice(round(first_h * steps_per_h), round(last_h * steps_per_h))


@dataclass(frozen=True)
class RecordedDay(DayScenario):
    """A scenario whose course is kept; an experiment of the chapter."""

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{super().label}, recorded"

    def run(self) -> DayCourse:
        """Simulate it to the end."""
        seen: dict[str, list[Array]] = {}

        def watch(game: HvacGame) -> None:
            state = game.state
            now = {
                "outdoor_c": game.constants.outdoor[game.elapsed[0]],
                "temperature_c": state.temperature,
                "reading_c": state.reading,
                "residual_c2": state.residual,
                "estimate_c": state.fed,
                "heating_w": state.heating,
                "choice": state.choice,
            }
            for name, values in now.items():
                seen.setdefault(name, []).append(values.copy())

        outcome = self.play(watch)
        for name in ("estimate_c", "heating_w", "choice"):  # decided at k, known at k + 1
            del seen[name][0]
        courses: dict[str, Any] = {name: np.array(each) for name, each in seen.items()}
        return DayCourse(**vars(outcome), config=self.config, **courses)
