"""The regression check: our numbers under the names that the reference file has for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.sensors import sensor_sets
from cps_paper.evidence import NotRunError
from cps_paper.hvac.cells import table_rows
from cps_paper.hvac.clear_day import zone_days
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import (
    ATTACKS,
    DAYS,
    DEFENCES,
    EARLY,
    EARLY_COUNTS,
    TABLE_DAYS,
    compared,
    early,
    undefended,
)
from cps_paper.hvac.impacts import mean_rise_c, outcomes
from cps_paper.hvac.scenario import DayOutcome
from cps_paper.verdicts import Check, Reference, Tolerance, shipped_rows

EARLY_FROM = 200  # step from which the reference averages early attacks


@dataclass(frozen=True)
class Measure:
    """A number of ours; `days` are the single ones (B,) where it is a mean."""

    group: str
    case: str
    value: float
    days: FloatArray | None = None

    @property
    def standard_error(self) -> float | None:
        """Of the mean, by the spread of the days; None for numbers without chance."""
        if self.days is None or len(self.days) < 2:
            return None
        return float(self.days.std(ddof=1) / np.sqrt(len(self.days)))


def measures(evidence: HvacEvidence) -> list[Measure]:
    """Everything that this run has simulated."""
    found: list[Measure] = []
    for group in GROUPS:
        try:
            found += list(group(evidence))
        except NotRunError:
            continue
    return found


def _clear_day(evidence: HvacEvidence) -> Iterator[Measure]:
    for day in zone_days(evidence):
        yield Measure("clear day", f"zone {day.zone} before noon", day.morning_error_c)
        yield Measure("clear day", f"zone {day.zone} after 13 h", day.afternoon_error_c)


def _undefended(evidence: HvacEvidence) -> Iterator[Measure]:
    yield _impact("Fig. 4.4a", "attack-free", evidence[undefended("none", 0)])
    for attacker in ATTACKS:
        for count in range(1, 5):
            yield _impact("Fig. 4.4a", f"{attacker} {count}", evidence[undefended(attacker, count)])


def _first_zone(evidence: HvacEvidence) -> Iterator[Measure]:
    yield _impact("Fig. 4.4b", "A_impact", evidence[undefended("constant", 1)])
    for zone, rise_c in enumerate(mean_rise_c(evidence).tolist(), 1):
        yield Measure("Fig. 4.4b", f"rise of zone {zone}", rise_c)


def _table(table: str, evidence: HvacEvidence) -> Iterator[Measure]:
    for row in table_rows(evidence, table):
        yield Measure(f"Table {table}", f"{row.sensors_used} sensors, {row.percent} %", row.ours)


def _bars(num_sensors: int, defender: str, evidence: HvacEvidence) -> Iterator[Measure]:
    group = f"{defender}, {num_sensors} sensors"
    yield _impact(group, "attack-free", evidence[compared(num_sensors, "none", defender, 0)])
    for attacker in ATTACKS:
        for count, bar in enumerate(outcomes(evidence, num_sensors, attacker, defender)[1:], 1):
            yield _impact(group, f"{attacker} {count}", bar)
            if attacker == "random":
                sets = bar.distinct_sets.astype(np.float64)
                yield Measure(group, f"sets used, {attacker} {count}", float(sets.mean()), sets)


def _sets(evidence: HvacEvidence) -> Iterator[Measure]:
    for num_sensors in DAYS:
        count = len(sensor_sets(compared(num_sensors, "none", "none", 0).config))
        yield Measure("number of sets", f"{num_sensors} sensors", float(count))


def _early(evidence: HvacEvidence) -> Iterator[Measure]:
    for onset, attacker in EARLY:
        for count in EARLY_COUNTS:
            days = evidence[early(onset, attacker, count)].impact_from(EARLY_FROM)
            yield Measure(f"mtd2, onset {onset}", f"{attacker} {count}", float(days.mean()), days)


def _impact(group: str, case: str, outcome: DayOutcome) -> Measure:
    return Measure(group, case, float(outcome.a_impact.mean()), outcome.a_impact)


GROUPS: tuple[Callable[[HvacEvidence], Iterator[Measure]], ...] = (
    _clear_day,
    _undefended,
    _first_zone,
    *(partial(_table, table) for table in TABLE_DAYS),
    _sets,
    *(partial(_bars, num_sensors, defender) for num_sensors in DAYS for defender in DEFENCES),
    _early,
)


@lru_cache(maxsize=1)
def references() -> Mapping[tuple[str, str], Reference]:
    """Those of `reference.csv` by group and case."""
    return {
        (row["group"], row["case"]): Reference(
            float(row["value"]),
            Tolerance(float(row["tolerance"]), row["kind"]),
            float(row["recorded"]) if row["recorded"] else None,
            row["reason"],
        )
        for row in shipped_rows("cps_paper.hvac")
    }


def checks(evidence: HvacEvidence) -> list[Check]:
    """The numbers for which there is a reference."""
    known = references()
    return [
        Check(f"{each.group}: {each.case}", each.value, known[each.group, each.case], each)
        for each in measures(evidence)
        if (each.group, each.case) in known
    ]
