"""What the chapter simulates, and the results under one accounting of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cps_baselines.rogue.square import SquareWave
from cps_baselines.rogue.switching import shipped_weights
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import OSCILLATION, PAPER, RogueConfig
from cps_envs.rogue.picture.scene import Scene
from cps_envs.rogue.problem import ROGUE
from cps_paper.evidence import Evidence
from cps_paper.rogue.course import RogueCourse, course_of
from cps_paper.rogue.heat_map import (
    FINE_S,
    FREQUENCIES_HZ,
    LEARNING_S,
    PASS,
    RATIOS,
    SOLID,
    STEADY_HZ,
    HeatMap,
)
from cps_paper.rogue.worlds import REPORTED, switching_damages

Wave = tuple[float, float]  # frequency in Hz, duty
Overrides = tuple[tuple[str, Any], ...]
ADVANCE_S = 1.2e-4  # rough CPU time of a simulated second of an episode
VERIFYING_WORLDS = 6


@dataclass(frozen=True)
class Waves:
    """Several square waves against a defender, all at once."""

    defender: str
    power_ratio: float
    waves: tuple[Wave, ...]
    contact: str = PASS
    duration_s: float = PAPER.duration_s
    overrides: Overrides = ()
    seed: int = 0

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return ADVANCE_S * self.duration_s * (4 + len(self.waves)) * _steps(self.overrides)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.defender}, ratio {self.power_ratio:g}, {self.contact}"

    def run(self) -> FloatArray:
        """The damages (F,)."""
        named = {"contact": self.contact, "duration_s": self.duration_s, "power_ratio": self.power_ratio}
        config = ROGUE.config("paper", {**named, **dict(self.overrides)})
        frequencies_hz, duties = np.array(self.waves).T
        attacker = SquareWave(ROGUE.game(config, 1).spec("attacker"), frequencies_hz, duties)
        players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": self.defender}
        return np.asarray(play_episodes(ROGUE, config, players, [self.seed] * len(self.waves))["damage"])


def _steps(overrides: Overrides) -> float:
    """Integration steps over those of the preset."""
    return PAPER.dt_s / float(dict(overrides).get("dt_s", PAPER.dt_s))


def square_waves(frequencies_hz: tuple[float, ...]) -> tuple[Wave, ...]:
    """Waves that drive half the time."""
    return tuple((frequency, 0.5) for frequency in frequencies_hz)


FULL_THROTTLE: Wave = (0.1, 1.0)


@dataclass(frozen=True)
class Ride:
    """One episode with its course."""

    attacker: str
    defender: str
    power_ratio: float = 1.0
    contact: str = PASS
    duration_s: float = PAPER.duration_s
    human_returns: bool = False
    overrides: Overrides = ()
    seed: int = 0

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 10 * ADVANCE_S * self.duration_s * _steps(self.overrides)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.attacker} on {self.defender}, {self.contact}"

    @property
    def config(self) -> RogueConfig:
        """What it is run under."""
        names = ("power_ratio", "contact", "duration_s", "human_returns")
        named = {name: getattr(self, name) for name in names}
        config: RogueConfig = ROGUE.config("paper", {**named, **dict(self.overrides)})
        return config

    def run(self) -> RogueCourse:
        """Play it."""
        config, scenes = self.config, list[Scene]()
        players: dict[Role, PolicyReference] = {"attacker": self.attacker, "defender": self.defender}
        play_episodes(ROGUE, config, players, [self.seed], on_step=lambda game: scenes.append(game.scene(0)))
        return course_of(config, scenes)


@dataclass(frozen=True)
class ClosedLoop:
    """The searched attacker `switching` in the setting of its search: `SOLID`, 60 s."""

    against: str  # what it was searched against
    defender: str
    power_ratio: float

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return ADVANCE_S * LEARNING_S * (4 + 2 * VERIFYING_WORLDS)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"switching against {self.against} on {self.defender}, ratio {self.power_ratio:g}, {SOLID}"

    def run(self) -> tuple[float, float]:
        """Damages in m/s: at the step of the preset; and the mean over perturbed worlds at half of it."""
        weights = shipped_weights()[self.against, self.power_ratio][np.newaxis]
        setting = ((self.defender,), self.power_ratio)
        worlds = range(REPORTED, REPORTED + VERIFYING_WORLDS)
        nominal = switching_damages(weights, *setting, [0], spread=0.0)
        return float(nominal.mean()), float(switching_damages(weights, *setting, worlds, refined=True).mean())


@dataclass(frozen=True)
class RogueEvidence(Evidence):
    """Results by experiment; those that this class names have its `contact`."""

    contact: str = PASS

    def under(self, contact: str) -> RogueEvidence:
        """The same results, read under another accounting of contacts."""
        return replace(self, contact=contact)

    def map(self, defender: str, ratios: Sequence[float] = RATIOS, overrides: Overrides = ()) -> HeatMap:
        """A heat map."""
        rows = [self[each] for each in map_rows(defender, self.contact, ratios, overrides)]
        return HeatMap(ratios, FREQUENCIES_HZ, np.stack(rows))

    def course(
        self, defender: str, frequency_hz: float, power_ratio: float = 1.0, *, human_returns: bool = False
    ) -> RogueCourse:
        """The course of a square wave."""
        return self[square_ride(defender, frequency_hz, self.contact, power_ratio, human_returns=human_returns)]

    def calm(self, defender: str) -> RogueCourse:
        """The course without an attack."""
        return self[calm_ride(defender, self.contact)]

    def steady(self, defender: str) -> tuple[float, float]:
        """Damages at equal power in the duration of the learning problem: the best square wave, full throttle."""
        damages = self[steady_waves(defender, self.contact)]
        return float(damages[:-1].max()), float(damages[-1])


def map_rows(defender: str, contact: str, ratios: Sequence[float] = RATIOS, overrides: Overrides = ()) -> list[Waves]:
    """The experiments behind a heat map, ratio by ratio."""
    waves = square_waves(FREQUENCIES_HZ)
    return [Waves(defender, ratio, waves, contact, overrides=overrides) for ratio in ratios]


def square_ride(
    defender: str, frequency_hz: float, contact: str, power_ratio: float = 1.0, *, human_returns: bool = False
) -> Ride:
    """A square wave, with its course."""
    return Ride(f"square?frequency_hz={frequency_hz:g}", defender, power_ratio, contact, human_returns=human_returns)


def calm_ride(defender: str, contact: str) -> Ride:
    """The same platoon without an attack, with its course."""
    return Ride("none", defender, contact=contact)


def seat_overrides(num_vehicles: int, seat: int) -> Overrides:
    """Another platoon than that of the maps, or another seat; none for theirs. Longer rows need a finer step."""
    if (num_vehicles, seat) == (PAPER.num_vehicles, PAPER.attacker_index):
        return ()
    return ("num_vehicles", num_vehicles), ("attacker_index", seat), ("dt_s", FINE_S)


def swaying_ride(attacker: str, power_ratio: float = 1.0) -> Ride:
    """An attacker that drives by (5.15) with some gains, in preset `oscillation`, against the linear law."""
    overrides = tuple((name, getattr(OSCILLATION, name)) for name in ("num_vehicles", "attacker_index", "dt_s"))
    contact, duration_s = OSCILLATION.contact, OSCILLATION.duration_s
    return Ride(attacker, "pd", power_ratio, contact, duration_s, overrides=overrides)


def steady_waves(defender: str, contact: str, power_ratio: float = 1.0) -> Waves:
    """Square waves of many frequencies, and full throttle last."""
    waves = (*square_waves(STEADY_HZ), FULL_THROTTLE)
    return Waves(defender, power_ratio, waves, contact, LEARNING_S)


def searched_ride(defender: str, contact: str) -> Ride:
    """The attacker that was searched against a defender, at equal power, with its course."""
    return Ride(f"switching?against={defender}", defender, contact=contact, duration_s=LEARNING_S)
