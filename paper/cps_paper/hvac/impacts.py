"""Attacks by defence and number of attacked sensors: claims C11 to C14, Figs. 4.7 and 4.8, C31 to C42 and C48."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.sensors import sensor_sets
from cps_paper.claims import Claim, Finding, joined
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import (
    ATTACKS,
    LEAST_MEAN,
    MODEL_FALLBACK,
    compared,
    first_two,
    first_zone,
    undefended,
)
from cps_paper.hvac.observers import SELECTED_SHARE, residuals
from cps_paper.hvac.rules import CLAIMS, MOSTLY, equals, of_printed, shown_impacts
from cps_paper.hvac.scenario import DayCourse, DayOutcome
from cps_paper.verdicts import NOT, PARTLY, REPRODUCED, by_construction, of_cases


def outcomes(evidence: HvacEvidence, num_sensors: int, attacker: str, defender: str) -> list[DayOutcome]:
    """The bars of one attack and one defence: attack-free, then 1 to all sensors attacked."""
    return [evidence[compared(num_sensors, attacker, defender, count)] for count in range(num_sensors + 1)]


def impacts(evidence: HvacEvidence, num_sensors: int, attacker: str, defender: str) -> FloatArray:
    """Their mean A_impact (n_s + 1,), C2."""
    return np.array([each.a_impact.mean() for each in outcomes(evidence, num_sensors, attacker, defender)])


def failing_line(evidence: HvacEvidence, num_sensors: int) -> float:
    """The impact of attack-free days without any defence, C2: above it a defence has failed."""
    return float(evidence[compared(num_sensors, "none", "none", 0)].a_impact.mean())


def first_failing(values: FloatArray, line: float) -> int | None:
    """The smallest number of attacked sensors whose impact (n_s + 1,) exceeds the line; None if there is none."""
    above = np.flatnonzero(values[1:] > line)
    return int(above[0]) + 1 if len(above) else None


def lines_giving(values: FloatArray, count: int) -> tuple[float, float]:
    """The lines [low, high), C2, by which a defence with these impacts (n_s + 1,) first fails at `count` sensors."""
    return float(values[1:count].max()), float(values[count])


def equal_up_to(bars: list[DayOutcome]) -> int:
    """The largest number of attacked sensors up to which every impact equals the attack-free one, the first bar."""
    unequal = [count for count, each in enumerate(bars) if not equals(each, bars[0])]
    return unequal[0] - 1 if unequal else len(bars) - 1


SENSORS = {"C31": 4, "C35": 4, "C36": 4, "C37": 8, "C38": 8, "C42": 8}
MTD1_FAILS = {"C39": "constant", "C40": "sine", "C41": "random"}
PERCENT_EACH = 12.5  # of eight sensors
ABOVE = ("C41",)  # where the paper's share is the last that MTD1 stands


@CLAIMS.judges("C31", "C37")
def number_of_sets(evidence: HvacEvidence, claim: Claim) -> Finding:
    """By the rule of (4.31), which the paper gives for four sensors only."""
    ours = len(sensor_sets(compared(SENSORS[claim.id], "none", "none", 0).config))
    return Finding(ours, f"{ours} sets", by_construction(of_printed(ours, claim)))


@CLAIMS.judges("C32")
def mtd1_stands_one(evidence: HvacEvidence, claim: Claim) -> Finding:
    """MTD1 with one of four sensors attacked, by attack."""
    free = evidence[compared(4, "none", "mtd1", 0)]
    attacked = [evidence[compared(4, attacker, "mtd1", 1)] for attacker in ATTACKS]
    values = shown_impacts(each.a_impact.mean() for each in attacked)
    hold = [equals(each, free) for each in attacked]
    return Finding.of_cases(hold, f"{values}, attack-free {free.a_impact.mean():.1f} °C²")


@CLAIMS.judges("C33")
def mtd1_fails(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The fewest attacked sensors of four at which MTD1 fails, by attack."""
    line = failing_line(evidence, 4)
    rows = [impacts(evidence, 4, attacker, "mtd1") for attacker in ATTACKS]
    found = [first_failing(row, line) for row in rows]
    values = "; ".join(f"{attacker} {shown_impacts(row[1:])}" for attacker, row in zip(ATTACKS, rows, strict=True))
    return Finding(_common(found), f"{_counts(found)}: {values}; line {line:.1f} °C²", _agree(found, claim))


@CLAIMS.judges("C48")
def mtd1_ignores_size(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The steps in which MTD1 uses an attacked sensor: how often does J of its set exceed that of every intact set?"""
    shares = [_told(evidence[first_two(attacker)]) for attacker in ATTACKS]
    hold = [used >= SELECTED_SHARE and told > MOSTLY for used, told in shares]
    shown = "; ".join(
        f"{attacker}: an attacked sensor in {used:.0%} of the steps, in {told:.0%} of these with the larger J"
        for attacker, (used, told) in zip(ATTACKS, shares, strict=True)
    )
    return Finding.of_cases(hold, shown)


def _told(course: DayCourse) -> tuple[float, float]:
    """The share of the attacked steps whose set has an attacked sensor; of these, those that the size of J tells."""
    attacked = range(1, course.config.max_compromised + 1)
    flawed = np.array([not set(attacked).isdisjoint(sensors) for sensors in sensor_sets(course.config)])
    chosen = course.choice[course.onset_step :]
    every = residuals(course)[course.onset_step :]
    choosing = (chosen > 0) & (chosen <= len(flawed))
    place = np.clip(chosen - 1, 0, len(flawed) - 1)
    used = choosing & flawed[place]
    own = np.take_along_axis(every, place[..., np.newaxis], axis=2)[..., 0]
    told = own > every[..., ~flawed].max(axis=2)
    return float(used.mean()), float(told[used].mean()) if used.any() else 0.0


@CLAIMS.judges("C34")
def mtd2_equals(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Up to how many attacked sensors of four the impact under MTD2 equals the attack-free one, by attack."""
    rows = [outcomes(evidence, 4, attacker, LEAST_MEAN) for attacker in ATTACKS]
    found: list[int | None] = [equal_up_to(row) for row in rows]
    values = "; ".join(joined([each.a_impact.mean() for each in row[:4]], ".2f") for row in rows)
    return Finding(_common(found), f"{_counts(found)}: {values} °C²", _agree(found, claim))


@CLAIMS.judges("C35", "C38")
def mtd2_fails(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Where MTD2 fails, by attack and by what it does where no set passes, which the paper leaves open."""
    sensors = SENSORS[claim.id]
    line, found, shown = failing_line(evidence, sensors), [], []
    for name, last in (("least mean", LEAST_MEAN), ("model", MODEL_FALLBACK)):
        rows = [impacts(evidence, sensors, attacker, LEAST_MEAN) for attacker in ATTACKS]
        for row, attacker in zip(rows, ATTACKS, strict=True):
            row[-1] = evidence[compared(sensors, attacker, last, sensors)].a_impact.mean()
        counts = [first_failing(row, line) for row in rows]
        found += counts
        shown.append(f"fallback {name}: {_counts(counts)} ({shown_impacts(row[-1] for row in rows)} °C²)")
    return Finding(_common(found), "; ".join(shown), _agree(found, claim))


@CLAIMS.judges("C36", "C42")
def fewer_sets(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Distinct sets that MTD2 selects under the random attack, each count against the one before."""
    bars = outcomes(evidence, SENSORS[claim.id], "random", LEAST_MEAN)[1:]
    used = [float(each.distinct_sets.mean()) for each in bars]
    intact = [float(each.intact_sets.mean()) for each in bars]
    return Finding.of_comparisons(used[:-1], used[1:], f"{joined(used, '.3g')} sets (intact {joined(intact, '.2g')})")


@CLAIMS.judges(*MTD1_FAILS)
def mtd1_fails_of_eight(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The share of eight sensors at which MTD1 fails; the impact has no edge, so the line decides."""
    rows = {name: impacts(evidence, 8, attacker, "mtd1") for name, attacker in MTD1_FAILS.items()}
    counts = {name: _paper_count(each) for each in CLAIMS.printed() if (name := each.id) in MTD1_FAILS}
    lines = {name: lines_giving(row, counts[name]) for name, row in rows.items()}
    low, high = lines[claim.id]
    shared = any(max(low, other[0]) < min(high, other[1]) for name, other in lines.items() if name != claim.id)
    line = failing_line(evidence, 8)
    found = first_failing(rows[claim.id], line)
    verdict = REPRODUCED if found == counts[claim.id] else PARTLY if shared else NOT
    share = None if found is None else PERCENT_EACH * (found - (claim.id in ABOVE))
    at = "never" if share is None else f"{'above' if claim.id in ABOVE else 'at'} {share:g} %"
    shown = (
        f"{at} by the line of {line:.1f} °C²; as the paper by lines of {shown_impacts([low])} to "
        f"{shown_impacts([high])}: {shown_impacts(rows[claim.id][1:])}"
    )
    return Finding(share, shown, verdict)


def _paper_count(claim: Claim) -> int:
    """The number of attacked sensors at which MTD1 first fails in the paper."""
    return round(claim.number / PERCENT_EACH) + (claim.id in ABOVE)


def _agree(found: list[int | None], claim: Claim) -> str:
    return of_cases([each == claim.number for each in found])


def _common(found: list[int | None]) -> float | None:
    """The count that all cases have; None where they differ or have none."""
    return found[0] if len(set(found)) == 1 else None


def _counts(found: list[int | None]) -> str:
    return " / ".join("never" if each is None else str(each) for each in found)


NOTABLE_RISE_C = 0.5  # chosen
PARTS_OF_ATTACK = 3


@CLAIMS.judges("C11")
def grows_with_sensors(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Mean impacts with 0 to 4 sensors attacked, each against the one before."""
    more, fewer, shown = [], [], []
    for attacker in ATTACKS:
        impacts = [float(evidence[undefended(attacker, count)].a_impact.mean()) for count in range(5)]
        more += impacts[1:]
        fewer += impacts[:-1]
        shown.append(f"{attacker} {joined(impacts)}")
    return Finding.of_comparisons(more, fewer, f"{'; '.join(shown)} °C²")


@CLAIMS.judges("C12")
def first_sensor(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The mean impact with sensor 1 at 22 C; the weight R of the controller was chosen for it."""
    days = evidence[undefended("constant", 1)].a_impact
    ours = float(days.mean())
    shown = f"{ours:.1f} ± {days.std(ddof=1):.1f} °C² over {len(days)} days; R was chosen for it"
    return Finding(ours, shown, by_construction(of_printed(ours, claim)))


@CLAIMS.judges("C13")
def fourth_zone_rises(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The mean rise of zone 4 over the same days without an attack."""
    rise_c = mean_rise_c(evidence)
    rises = bool(rise_c[3] > NOTABLE_RISE_C)
    shown = f"zones 1 to 4 rise by {joined(rise_c.tolist(), '.1f')} °C on average"
    return Finding.of_cases([rises], shown)


@CLAIMS.judges("C14")
def input_rises(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The mean input of zone 1 in each third of the attack, against the one before."""
    course = evidence[first_zone("constant")]
    level = course.level_percent[course.onset_step :, :, 0]
    parts = [float(part.mean()) for part in np.array_split(level, PARTS_OF_ATTACK)]
    shown = f"mean {joined(parts)} % of E in thirds of the attack, up to {level.max(axis=0).mean():.0f} %"
    return Finding.of_comparisons(parts[1:], parts[:-1], shown)


def mean_rise_c(evidence: HvacEvidence) -> FloatArray:
    """How much warmer (n,) the zones are since the onset than on the same days without an attack, C."""
    attacked, free = evidence[first_zone("constant")], evidence[first_zone("none")]
    rise: FloatArray = (attacked.temperature_c - free.temperature_c)[attacked.onset_step :].mean(axis=(0, 1))
    return rise
