"""The claims of section 4.3.1 about the attack-free day: C01 to C10."""

from __future__ import annotations

from cps_baselines.hvac.reproduction.clear_day import NOON_H, OUTER_ZONES, START_H, energy_days, zone_days
from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import ENERGIES_W, noise_free
from cps_baselines.hvac.reproduction.rules import ALWAYS, CLAIMS, falling, of_printed
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.verdicts import REPRODUCED, of_cases

MORNING = f"{START_H:g} to {NOON_H:g} h"


@CLAIMS.judges("C01")
def errors_around(evidence: Evidence, claim: Claim) -> Finding:
    """The largest error of each zone, once all have warmed up, to the digits that the paper prints."""
    largest = [max(day.morning_error_c, day.afternoon_error_c) for day in zone_days(evidence)]
    hold = [of_printed(error, claim) == REPRODUCED for error in largest]
    return Finding(max(largest), f"largest {joined(largest, '.2f')} °C after {START_H:g} h", of_cases(hold))


@CLAIMS.judges("C02")
def outer_zones_exceed(evidence: Evidence, claim: Claim) -> Finding:
    """The largest error of zones 3 and 4 in the morning."""
    largest = [day.morning_error_c for day in zone_days(evidence) if day.zone in OUTER_ZONES]
    hold = [error > 1.0 for error in largest]
    return Finding(all(hold), f"largest {joined(largest, '.2f')} °C from {MORNING}", of_cases(hold))


@CLAIMS.judges("C03")
def outer_zones_unheated(evidence: Evidence, claim: Claim) -> Finding:
    """Hours of the morning in which zones 3 and 4 are not heated at all."""
    days = [day for day in zone_days(evidence) if day.zone in OUTER_ZONES]
    hold = [hour not in day.heated_hours for day in days for hour in range(int(START_H), int(NOON_H))]
    last = joined([max(day.heated_hours, default=-1) + 1 for day in days])
    shown = (
        f"mean {joined([day.morning_heating_w for day in days], '.1f')} W from {MORNING}, none after {last} h; "
        f"{sum(hold)} of {len(hold)} hours without"
    )
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C04")
def heats_only_below(evidence: Evidence, claim: Claim) -> Finding:
    """Heated steps in which the measured temperature is below the reference, by zone."""
    shares = [day.below_share for day in zone_days(evidence)]
    hold = [share >= ALWAYS for share in shares]
    shown = f"{joined([100.0 * share for share in shares])} % of the heated steps; it heats ahead of the cold"
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C05")
def reference(evidence: Evidence, claim: Claim) -> Finding:
    """The configuration's."""
    ours = noise_free(ENERGIES_W[0]).scenario.config.reference_c
    return Finding(ours, f"{ours:g} °C, an input", of_printed(ours, claim))


@CLAIMS.judges("C06", "C07", "C08")
def usual_level(evidence: Evidence, claim: Claim) -> Finding:
    """The most frequent level of the heated steps of zone 1 under one of the energies."""
    day = energy_days(evidence)[int(claim.id[1:]) - 6]
    shown = f"{day.usual_level_percent:g} % of {day.energy_w:g} W most often"
    return Finding(day.usual_level_percent, shown, of_printed(day.usual_level_percent, claim))


@CLAIMS.judges("C09")
def shorter_with_energy(evidence: Evidence, claim: Claim) -> Finding:
    """On-times from the lowest energy to the highest."""
    shares = [day.on_share for day in reversed(energy_days(evidence))]
    hold = falling(shares)
    energies = joined([energy_w / 1000.0 for energy_w in reversed(ENERGIES_W)], "g")
    return Finding(all(hold), f"on in {joined(shares, '.2f')} of the steps at {energies} kW", of_cases(hold))


@CLAIMS.judges("C10")
def worst_error(evidence: Evidence, claim: Claim) -> Finding:
    """The largest error of zone 1 under any energy."""
    worst = max(day.largest_error_c for day in energy_days(evidence))
    return Finding(worst, f"{worst:.2f} °C after {START_H:g} h", of_cases([worst < claim.number]))
