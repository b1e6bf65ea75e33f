"""The regression check: our damages against those of our second implementation of the same equations."""

from __future__ import annotations

from dataclasses import dataclass

from cps_baselines.rogue.reproduction.evidence import Evidence
from cps_baselines.rogue.reproduction.experiments import Waves, square_waves
from cps_baselines.rogue.reproduction.settings import TITLES
from cps_baselines.rogue.reproduction.shipped import shipped_rows

MAXIMUM = "maximum"


@dataclass(frozen=True)
class Reference:
    """What the other implementation has."""

    what: str  # MAXIMUM of a map, or a cell
    defender: str
    contact: str
    wave: tuple[float, float] | None  # power ratio and frequency in Hz of a cell
    damage: float
    tolerance: float  # absolute

    @property
    def label(self) -> str:
        """In words."""
        where = "maximum of the map" if self.wave is None else f"ratio {self.wave[0]:g}, {self.wave[1]:g} Hz"
        return f"{TITLES[self.defender]}, {self.contact}, {where}"

    @property
    def experiment(self) -> Waves | None:
        """The run behind a cell."""
        if self.wave is None:
            return None
        return Waves(self.defender, self.wave[0], square_waves((self.wave[1],)), self.contact)


@dataclass(frozen=True)
class Check:
    """Ours beside the reference."""

    reference: Reference
    ours: float

    @property
    def difference(self) -> float:
        """Relative."""
        return self.ours / self.reference.damage - 1

    @property
    def passed(self) -> bool:
        """Whether ours is within the tolerance."""
        return abs(self.ours - self.reference.damage) <= self.reference.tolerance


def references() -> list[Reference]:
    """All of `reference.csv`."""
    return [_reference(row) for row in shipped_rows("reference")]


def _reference(row: dict[str, str]) -> Reference:
    wave = None if row["what"] == MAXIMUM else (float(row["power_ratio"]), float(row["frequency_hz"]))
    damage, digits = float(row["damage"]), len(row["damage"].partition(".")[2])
    tolerance = float(row["tolerance"]) * damage + 0.5 * 10**-digits
    return Reference(row["what"], row["defender"], row["contact"], wave, damage, tolerance)


def check(evidence: Evidence, *, maps: bool) -> list[Check]:
    """The cells, and with `maps` the maxima."""
    checks = []
    for each in references():
        if each.experiment is not None:
            checks.append(Check(each, float(evidence[each.experiment][0])))
        elif maps:
            checks.append(Check(each, evidence.under(each.contact).map(each.defender).highest))
    return checks
