"""The results of the chapter's experiments under one accounting of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cps_baselines.reproduction import evidence as shared
from cps_baselines.rogue.reproduction.course import Course
from cps_baselines.rogue.reproduction.experiments import FULL_THROTTLE, Overrides, Ride, Waves, square_waves
from cps_baselines.rogue.reproduction.heat_map import HeatMap
from cps_baselines.rogue.reproduction.settings import FINE_S, FREQUENCIES_HZ, LEARNING_S, PASS, RATIOS, STEADY_HZ
from cps_envs.rogue.config import OSCILLATION, PAPER


@dataclass(frozen=True)
class Evidence(shared.Evidence):
    """Results by experiment; those that this class names have its `contact`."""

    contact: str = PASS

    def under(self, contact: str) -> Evidence:
        """The same results, read under another accounting of contacts."""
        return replace(self, contact=contact)

    def map(self, defender: str, ratios: Sequence[float] = RATIOS, overrides: Overrides = ()) -> HeatMap:
        """A heat map."""
        rows = [self[each] for each in map_rows(defender, self.contact, ratios, overrides)]
        return HeatMap(ratios, FREQUENCIES_HZ, np.stack(rows))

    def course(
        self, defender: str, frequency_hz: float, power_ratio: float = 1.0, *, human_returns: bool = False
    ) -> Course:
        """The course of a square wave."""
        return self[square_ride(defender, frequency_hz, self.contact, power_ratio, human_returns=human_returns)]

    def calm(self, defender: str) -> Course:
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


def swaying_ride(attacker: str) -> Ride:
    """An attacker that drives by (5.15) with some gains, in preset `oscillation`, against the linear law."""
    overrides = tuple((name, getattr(OSCILLATION, name)) for name in ("num_vehicles", "attacker_index", "dt_s"))
    return Ride(attacker, "pd", contact=OSCILLATION.contact, duration_s=OSCILLATION.duration_s, overrides=overrides)


def steady_waves(defender: str, contact: str, power_ratio: float = 1.0) -> Waves:
    """Square waves of many frequencies, and full throttle last."""
    waves = (*square_waves(STEADY_HZ), FULL_THROTTLE)
    return Waves(defender, power_ratio, waves, contact, LEARNING_S)


def searched_ride(defender: str, contact: str) -> Ride:
    """The attacker that was searched against a defender, at equal power, with its course."""
    return Ride(f"switching?against={defender}", defender, contact=contact, duration_s=LEARNING_S)
