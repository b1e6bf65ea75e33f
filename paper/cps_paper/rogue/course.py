"""An episode with its course kept, and what can be read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.picture.scene import Scene


@dataclass(frozen=True)
class RogueCourse:
    """T moments, one per decision, of n vehicles from the rear to the leader; `attacker` is the seized one's index."""

    config: RogueConfig
    attacker: int
    time_s: FloatArray  # (T,)
    position_m: FloatArray  # (T, n)
    speed_mps: FloatArray  # (T, n)
    acceleration_mps2: FloatArray  # (T, n)
    reference_m: FloatArray  # (T,) where the leader ought to be
    growth_m: FloatArray  # (T, n) separation set-points minus sigma
    alarm: IntArray  # (T, n)
    human: BoolArray  # (T, n)
    pair_damage: FloatArray  # (T, n - 1)

    @property
    def damage(self) -> FloatArray:
        """Of all pairs (T,) so far."""
        return np.asarray(self.pair_damage.sum(axis=1))

    @property
    def final_damage(self) -> float:
        """At the end."""
        return float(self.damage[-1])

    @property
    def separation_m(self) -> FloatArray:
        """Between centres (T, n - 1)."""
        return np.diff(self.position_m, axis=1)

    @property
    def behind_m(self) -> FloatArray:
        """Each vehicle (T, n) behind the place that the reference has for it."""
        n = self.position_m.shape[1]
        places = self.reference_m[:, np.newaxis] - self.config.separation_m * np.arange(n - 1, -1, -1.0)
        return np.asarray(places - self.position_m)

    @property
    def intact(self) -> list[int]:
        """Indices of the vehicles that nobody has seized."""
        return [i for i in range(self.position_m.shape[1]) if i != self.attacker]

    @property
    def disbanded_s(self) -> float | None:
        """When human drivers took over; None if they did not."""
        moments = np.flatnonzero(self.human.any(axis=1))
        return None if not len(moments) else float(self.time_s[moments[0]])

    def at(self, time_s: float) -> int:
        """The moment that belongs to a time."""
        return int(np.argmin(np.abs(self.time_s - time_s)))

    def grows_throughout(self, parts: int, least_share: float) -> bool:
        """Whether the damage grows in each of so many equal parts of the time, by at least a share of all of it."""
        ends = self.damage[np.linspace(0, len(self.time_s) - 1, parts + 1).astype(int)]
        return bool(ends[-1] > 0 and np.all(np.diff(ends) >= least_share * ends[-1]))


def course_of(config: RogueConfig, scenes: Sequence[Scene]) -> RogueCourse:
    """The course that consists of these moments."""
    return RogueCourse(
        config=config,
        attacker=scenes[0].attacker,
        time_s=np.array([scene.time_s for scene in scenes]),
        position_m=np.stack([scene.position for scene in scenes]),
        speed_mps=np.stack([scene.speed for scene in scenes]),
        acceleration_mps2=np.stack([scene.acceleration for scene in scenes]),
        reference_m=np.array([scene.reference_m for scene in scenes]),
        growth_m=np.stack([scene.growth for scene in scenes]),
        alarm=np.stack([scene.alarm for scene in scenes]),
        human=np.array([[law == "human" for law in scene.law] for scene in scenes]),
        pair_damage=np.stack([scene.damage for scene in scenes]),
    )
