"""Two vehicles that attack together beside one of twice the power: by the best square waves of each."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.rogue.experiments import Overrides, RogueEvidence, Wave, Waves
from cps_paper.rogue.heat_map import FINE_S, LEARNING_S, MAPS, SOLID, TITLES

SEATS = (2, 3, 4)  # of five vehicles; the single attacker takes the best of them
TEAM = (2, 4)
DOUBLE = 2.0
FREQUENCIES_HZ = tuple(np.round(np.geomspace(0.02, 0.5, 15), 4).tolist())  # chosen, with the next two
DUTIES = (0.5, 0.7, 0.85)
SHIFTS = (0.0, 0.25, 0.5, 0.75)  # of the front one behind the rear one, in periods
WAVES: tuple[Wave, ...] = tuple(product(FREQUENCIES_HZ, DUTIES))


@dataclass(frozen=True)
class Best:
    """The largest damage in m/s, and the seat or the shift that does it."""

    damage: float
    where: float


@dataclass(frozen=True)
class Beside:
    """What each kind of attacker does to a defender."""

    defender: str
    one: Best  # a vehicle of equal power
    two: Best
    double: Best  # a vehicle of twice the power

    @property
    def share(self) -> float:
        """Two vehicles against one of twice the power."""
        return self.two.damage / self.double.damage


def alone(defender: str, seat: int, power_ratio: float) -> Waves:
    """One vehicle."""
    return _waves(defender, power_ratio, ("attacker_index", seat))


def together(defender: str, shift: float) -> Waves:
    """Both of `TEAM`, of equal power."""
    return _waves(defender, 1.0, ("attacker_indices", TEAM), shift)


def _waves(defender: str, power_ratio: float, seat: tuple[str, object], shift: float = 0.0) -> Waves:
    overrides: Overrides = (seat, ("dt_s", FINE_S))
    return Waves(defender, power_ratio, SOLID, LEARNING_S, overrides, waves=WAVES, shift=shift)


def together_experiments() -> list[Waves]:
    """Everything behind the table."""
    found: list[Waves] = []
    for defender in MAPS.values():
        found += [alone(defender, seat, ratio) for seat, ratio in product(SEATS, (1.0, DOUBLE))]
        found += [together(defender, shift) for shift in SHIFTS]
    return found


def besides(evidence: RogueEvidence) -> list[Beside]:
    """The table, defender by defender."""
    return [
        Beside(
            defender,
            one=_best(evidence, {seat: alone(defender, seat, 1.0) for seat in SEATS}),
            two=_best(evidence, {shift: together(defender, shift) for shift in SHIFTS}),
            double=_best(evidence, {seat: alone(defender, seat, DOUBLE) for seat in SEATS}),
        )
        for defender in MAPS.values()
    ]


def _best(evidence: RogueEvidence, tried: dict[float, Waves] | dict[int, Waves]) -> Best:
    damages = {where: float(evidence[waves].max()) for where, waves in tried.items()}
    where = max(damages, key=lambda each: damages[each])
    return Best(damages[where], where)


def together_table(evidence: RogueEvidence) -> ExhibitTable:
    """Two seats beside one of double power."""
    return ExhibitTable("Two attackers in one platoon, and one of twice the power", COLUMNS, besides(evidence), NOTES)


COLUMNS = (
    Column("", lambda each: TITLES[each.defender]),
    Column("one", lambda each: each.one.damage, "{:.1f}"),
    Column("seat", lambda each: each.one.where, "{:g}"),
    Column("two", lambda each: each.two.damage, "{:.1f}"),
    Column("shift", lambda each: each.two.where, "{:g}"),
    Column("one of twice the power", lambda each: each.double.damage, "{:.1f}"),
    Column("seat ", lambda each: each.double.where, "{:g}"),
    Column("two / twice", lambda each: each.share, "{:.0%}"),
)
NOTES = (
    f"Contact solid, {LEARNING_S:g} s, m/s: best of {len(FREQUENCIES_HZ)} frequencies x {len(DUTIES)} duties. One "
    f"vehicle takes the best of the seats {', '.join(map(str, SEATS))} of five; two sit in {TEAM[0]} and {TEAM[1]}, "
    f"the front one the best of {len(SHIFTS)} shifts later.",
    "Lower bounds: square waves are the paper's attacker, and no search in closed loop stands behind them.",
)
