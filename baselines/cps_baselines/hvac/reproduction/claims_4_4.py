"""The claims of section 4.4 about attacks without a defence: C11 to C14."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import ATTACKS, first_zone, undefended
from cps_baselines.hvac.reproduction.rules import CLAIMS, of_printed, rising
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.verdicts import of_cases
from cps_envs.core.types import FloatArray

NOTABLE_RISE_C = 0.5  # chosen
PARTS_OF_ATTACK = 3


@CLAIMS.judges("C11")
def grows_with_sensors(evidence: Evidence, claim: Claim) -> Finding:
    """Mean impacts with 0 to 4 sensors attacked, each against the one before."""
    hold, shown = [], []
    for attacker in ATTACKS:
        impacts = [float(evidence[undefended(attacker, count)].a_impact.mean()) for count in range(5)]
        hold += rising(impacts)
        shown.append(f"{attacker} {joined(impacts)}")
    return Finding(all(hold), f"{'; '.join(shown)} °C²", of_cases(hold))


@CLAIMS.judges("C12")
def first_sensor(evidence: Evidence, claim: Claim) -> Finding:
    """The mean impact with sensor 1 at 22 C; the weight R of the controller was chosen for it."""
    days = evidence[undefended("constant", 1)].a_impact
    ours = float(days.mean())
    shown = f"{ours:.1f} ± {days.std(ddof=1):.1f} °C² over {len(days)} days; calibrated, not independent"
    return Finding(ours, shown, of_printed(ours, claim))


@CLAIMS.judges("C13")
def fourth_zone_rises(evidence: Evidence, claim: Claim) -> Finding:
    """The mean rise of zone 4 over the same days without an attack."""
    rise_c = mean_rise_c(evidence)
    rises = bool(rise_c[3] > NOTABLE_RISE_C)
    shown = f"zones 1 to 4 rise by {joined(rise_c.tolist(), '.1f')} °C on average"
    return Finding(rises, shown, of_cases([rises]))


@CLAIMS.judges("C14")
def input_rises(evidence: Evidence, claim: Claim) -> Finding:
    """The mean input of zone 1 in each third of the attack, against the one before."""
    course = evidence[first_zone("constant")]
    level = course.level_percent[course.onset_step :, :, 0]
    parts = [float(part.mean()) for part in np.array_split(level, PARTS_OF_ATTACK)]
    hold = rising(parts)
    shown = f"mean {joined(parts)} % of E in thirds of the attack, up to {level.max(axis=0).mean():.0f} %"
    return Finding(all(hold), shown, of_cases(hold))


def mean_rise_c(evidence: Evidence) -> FloatArray:
    """How much warmer (n,) the zones are since the onset than on the same days without an attack, C."""
    attacked, free = evidence[first_zone("constant")], evidence[first_zone("none")]
    rise: FloatArray = (attacked.temperature_c - free.temperature_c)[attacked.onset_step :].mean(axis=(0, 1))
    return rise
