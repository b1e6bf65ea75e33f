"""What the chapter simulates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_baselines.rogue.reproduction.course import Course, course_of
from cps_baselines.rogue.reproduction.settings import LEARNING_S, PASS, SOLID
from cps_baselines.rogue.square import SquareWave
from cps_baselines.rogue.switching import shipped_weights
from cps_baselines.rogue.switching_search import REPORTED, SwitchingSearch, switching_damages
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import PAPER, RogueConfig
from cps_envs.rogue.picture.scene import Scene
from cps_envs.rogue.problem import ROGUE

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

    def run(self) -> Course:
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
        search = SwitchingSearch(self.defender, self.power_ratio)
        worlds = range(REPORTED, REPORTED + VERIFYING_WORLDS)
        nominal = switching_damages(weights, search, [0], spread=0.0)
        return float(nominal.mean()), float(switching_damages(weights, search, worlds, refined=True).mean())
