"""The regression check: our damages against those of our second implementation of the same equations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from cps_paper.rogue.experiments import RogueEvidence, Waves, square_waves
from cps_paper.rogue.heat_map import TITLES
from cps_paper.verdicts import ABSOLUTE, Check, Reference, Tolerance, shipped_rows


@dataclass(frozen=True)
class Damage:
    """A number of the other implementation."""

    defender: str
    contact: str
    wave: tuple[float, float] | None  # power ratio and frequency in Hz of a cell; None: the maximum of a map
    reference: Reference

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
        return Waves(self.defender, self.wave[0], self.contact, waves=square_waves((self.wave[1],)))


@lru_cache(maxsize=1)
def damages() -> tuple[Damage, ...]:
    """All of `reference.csv`."""
    return tuple(map(_damage, shipped_rows("cps_paper.rogue")))


def _damage(row: dict[str, str]) -> Damage:
    """Tolerances there are relative; half of the last digit that is given comes on top."""
    wave = None if row["what"] == "maximum" else (float(row["power_ratio"]), float(row["frequency_hz"]))
    damage, digits = float(row["damage"]), len(row["damage"].partition(".")[2])
    tolerance = Tolerance(float(row["tolerance"]) * damage + 0.5 * 10**-digits, ABSOLUTE)
    return Damage(row["defender"], row["contact"], wave, Reference(damage, tolerance))


def checks(evidence: RogueEvidence, *, maps: bool) -> list[Check]:
    """The cells, and with `maps` the maxima."""
    made = []
    for each in damages():
        if each.experiment is not None:
            made.append(Check(each.label, float(evidence[each.experiment][0]), each.reference))
        elif maps:
            highest = evidence.under(each.contact).map(each.defender).highest
            made.append(Check(each.label, highest, each.reference))
    return made
