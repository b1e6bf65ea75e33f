"""The claims of section 4.5.1 about Tables 4.1 and 4.2: C24 to C28."""

from __future__ import annotations

from collections.abc import Sequence

from cps_baselines.hvac.reproduction.cells import Row, table_rows
from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import PERCENTS, TABLE_SENSORS
from cps_baselines.hvac.reproduction.rules import CLAIMS, CLOSE, falling, of_printed, rising
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.verdicts import NEAR, NOT, PARTLY, REPRODUCED, of_cases

WELL_C = 0.5  # the text: the controller performs well with errors "close to or below 0.5 C"


@CLAIMS.judges("C24")
def raw_under_noise(evidence: Evidence, claim: Claim) -> Finding:
    """Errors at 20 % in each zone, and their growth above it."""
    rows = _using(table_rows(evidence, "4.1"), 0)
    means = [row.ours for row in rows]
    hold = [cell.ours <= CLOSE * WELL_C for cell in rows[0].cells]
    hold += rising(means)
    shown = f"zone mean {joined(means, '.2f')} °C at {joined(PERCENTS['4.1'])} %"
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C25")
def estimates_under_noise(evidence: Evidence, claim: Claim) -> Finding:
    """Every cell of Table 4.1 that uses estimates."""
    values = [cell.ours for row in table_rows(evidence, "4.1") if row.sensors_used for cell in row.cells]
    hold = [value <= CLOSE * claim.number for value in values]
    shown = f"{sum(hold)} of {len(hold)} cells up to {CLOSE * claim.number:.2f} °C, largest {max(values):.2f} °C"
    return Finding(max(values), shown, of_cases(hold))


@CLAIMS.judges("C26", "C28")
def more_sensors_help(evidence: Evidence, claim: Claim) -> Finding:
    """Under every condition, whether the zone mean falls with every further sensor."""
    table = "4.1" if claim.id == "C26" else "4.2"
    rows = table_rows(evidence, table)
    smaller = []
    for percent in PERCENTS[table]:
        means = [row.ours for row in rows if row.percent == percent and row.sensors_used]
        smaller.append(falling(means))
    hold = [all(steps) for steps in smaller]
    ends = "; ".join(f"{used}: {joined(_means(rows, used), '.2f')}" for used in (1, len(TABLE_SENSORS)))
    count = sum(map(sum, smaller))
    shown = f"smaller in {count} of {sum(map(len, smaller))} comparisons; zone mean with {ends} °C"
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C27")
def range_of_uncertainty(evidence: Evidence, claim: Claim) -> Finding:
    """The widest range with a zone mean close to or below WELL_C, by source of temperatures."""
    rows = table_rows(evidence, "4.2")
    widest = [_widest(_using(rows, used)) for used in range(len(TABLE_SENSORS) + 1)]
    verdicts = {of_printed(each, claim) for each in widest}
    verdict = REPRODUCED if verdicts == {REPRODUCED} else PARTLY if verdicts & {REPRODUCED, NEAR} else NOT
    shown = f"{joined(widest)} % with measurements and 1 to 4 sensors; measurements {joined(_means(rows, 0), '.2f')} °C"
    return Finding(float(widest[0]), shown, verdict)


def _using(rows: Sequence[Row], sensors_used: int) -> list[Row]:
    return [row for row in rows if row.sensors_used == sensors_used]


def _means(rows: Sequence[Row], sensors_used: int) -> list[float]:
    return [row.ours for row in _using(rows, sensors_used)]


def _widest(rows: Sequence[Row]) -> int:
    """The last condition up to which all are well, in percent; 0 where the first is not."""
    widest = 0
    for row in rows:
        if row.ours > CLOSE * WELL_C:
            break
        widest = row.percent
    return widest
