"""What the chapter simulates, and the results under one accounting of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cps_baselines.rogue.square import SquareWave
from cps_baselines.rogue.switching import shipped_weights
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
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
class Attacked:
    """A defender in a configuration that differs from preset `paper` in these fields."""

    defender: str
    power_ratio: float = 1.0
    contact: str = PASS
    duration_s: float = PAPER.duration_s
    overrides: Overrides = ()
    seed: int = 0

    @property
    def config(self) -> RogueConfig:
        """What it is played under."""
        named = {"contact": self.contact, "duration_s": self.duration_s, "power_ratio": self.power_ratio}
        config: RogueConfig = ROGUE.config("paper", {**named, **dict(self.overrides)})
        return config

    @property
    def step_s(self) -> float:
        """CPU time of an episode's steps, roughly."""
        return ADVANCE_S * self.duration_s * PAPER.dt_s / float(dict(self.overrides).get("dt_s", PAPER.dt_s))


@dataclass(frozen=True)
class Waves(Attacked):
    """Several square waves against a defender, all at once."""

    waves: tuple[Wave, ...] = ()
    shift: float = 0.0  # of several attackers, see `SquareWave`

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return (4 + len(self.waves)) * self.step_s

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.defender}, ratio {self.power_ratio:g}, {self.contact}"

    def run(self) -> FloatArray:
        """The damages (F,)."""
        frequencies_hz, duties = np.array(self.waves).T
        attacker = SquareWave(ROGUE.game(self.config, 1).spec("attacker"), frequencies_hz, duties, self.shift)
        players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": self.defender}
        return np.asarray(play_episodes(ROGUE, self.config, players, [self.seed] * len(self.waves))["damage"])


def square_waves(frequencies_hz: tuple[float, ...]) -> tuple[Wave, ...]:
    """Waves that drive half the time."""
    return tuple((frequency, 0.5) for frequency in frequencies_hz)


FULL_THROTTLE: Wave = (0.1, 1.0)


@dataclass(frozen=True)
class Ride(Attacked):
    """One episode with its course."""

    attacker: str = "none"

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 10 * self.step_s

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.attacker} on {self.defender}, {self.contact}"

    def run(self) -> RogueCourse:
        """Play it."""
        scenes: list[Scene] = []
        players: dict[Role, PolicyReference] = {"attacker": self.attacker, "defender": self.defender}
        play_episodes(ROGUE, self.config, players, [self.seed], on_step=lambda game: scenes.append(game.scene(0)))
        return course_of(self.config, scenes)


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
    return [Waves(defender, ratio, contact, overrides=overrides, waves=waves) for ratio in ratios]


def square_ride(
    defender: str, frequency_hz: float, contact: str, power_ratio: float = 1.0, *, human_returns: bool = False
) -> Ride:
    """A square wave, with its course."""
    overrides: Overrides = (("human_returns", True),) if human_returns else ()
    attacker = f"square?frequency_hz={frequency_hz:g}"
    return Ride(defender, power_ratio, contact, overrides=overrides, attacker=attacker)


def calm_ride(defender: str, contact: str) -> Ride:
    """The same platoon without an attack, with its course."""
    return Ride(defender, contact=contact)


def seat_overrides(num_vehicles: int, seat: int) -> Overrides:
    """Another platoon than that of the maps, or another seat; none for theirs. Longer rows need a finer step."""
    if (num_vehicles, seat) == (PAPER.num_vehicles, PAPER.attacker_index):
        return ()
    return ("num_vehicles", num_vehicles), ("attacker_index", seat), ("dt_s", FINE_S)


def swaying_ride(attacker: str, power_ratio: float) -> Ride:
    """An attacker that drives by (5.15) with some gains, in preset `oscillation` with this power, against `pd`."""
    overrides = tuple((name, getattr(OSCILLATION, name)) for name in ("num_vehicles", "attacker_index", "dt_s"))
    contact, duration_s = OSCILLATION.contact, OSCILLATION.duration_s
    return Ride("pd", power_ratio, contact, duration_s, overrides, attacker=attacker)


def steady_waves(defender: str, contact: str, power_ratio: float = 1.0) -> Waves:
    """Square waves of many frequencies, and full throttle last."""
    return Waves(defender, power_ratio, contact, LEARNING_S, waves=(*square_waves(STEADY_HZ), FULL_THROTTLE))


def searched_ride(defender: str, contact: str) -> Ride:
    """The attacker that was searched against a defender, at equal power, with its course."""
    return Ride(defender, contact=contact, duration_s=LEARNING_S, attacker=f"switching?against={defender}")
