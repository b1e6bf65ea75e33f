"""The parts that are played in the environment, as tables of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_paper.disbanding.experiments import PLATOONS, TAUS_S, DisbandingEvidence
from cps_paper.disbanding.played import DEFENDERS, READINGS, PlayedReading
from cps_paper.exhibit import Column, ExhibitTable, across

PLAYED = (
    "N = 10 where nothing else is said, x_d = 5 m. The lead platoon is disbanded at 1 s. Defenders act every 0.1 s, "
    "where `heuristic` is weaker than at every integration step. Collisions: intact vehicles that are involved in one."
)
TEXT = (
    "A sensor: one vehicle is attacked and alerts its platoon link by link (2.2.2); all drivers take over at once in "
    "`paper`. The last two rows are means over 20 seeds."
)
RIDE_NOTE = (
    "Of the vehicles of intact platoons: root mean squares of acceleration and of its changes within 0.1 s, traction "
    "of a passenger car (522 kJ/km at a steady 31 m/s), and the time from the attack until all keep within 10 % of the "
    "desired speed; 179 s means that the episode ends before."
)


def platoons_tables(evidence: DisbandingEvidence) -> list[ExhibitTable]:
    """E_v and collisions over N, one table per tau."""
    return [_platoons(evidence, tau_s) for tau_s in TAUS_S]


def platoons_data(evidence: DisbandingEvidence) -> list[dict[str, Any]]:
    """Every defender for every N: all metrics of the episode, for JSON."""
    return [
        {
            "defender": name,
            "tau_s": tau_s,
            "num_platoons": count,
            **evidence[evidence.defended(count, tau_s, name)],
        }
        for name in DEFENDERS
        for tau_s in TAUS_S
        for count in PLATOONS
    ]


def _platoons(evidence: DisbandingEvidence, tau_s: float) -> ExhibitTable:
    names = across(DEFENDERS, str, lambda count, name: _shown(evidence[evidence.defended(count, tau_s, name)]))
    title = f"tau = {tau_s:g} s, N platoons: E_v in percent over intact vehicles (collisions)"
    return ExhibitTable(title, (Column("N", str), *names), PLATOONS, (PLAYED,) if tau_s == TAUS_S[-1] else ())


def readings_tables(evidence: DisbandingEvidence) -> list[ExhibitTable]:
    """E_v and collisions under each reading of the text, one table per defender, and what passengers feel."""
    return [*(_readings(evidence, name) for name in DEFENDERS), _ride(evidence)]


def readings_data(evidence: DisbandingEvidence) -> list[dict[str, Any]]:
    """Every defender under every reading of the text: the means of all metrics, for JSON."""
    return [
        {
            "reading": each.name,
            "defender": name,
            "tau_s": tau_s,
            "episodes": each.episodes,
            **evidence[evidence.reading(each, tau_s, name)],
        }
        for each in READINGS
        for name in DEFENDERS
        for tau_s in TAUS_S
    ]


def _readings(evidence: DisbandingEvidence, name: str) -> ExhibitTable:
    def shown(each: PlayedReading, tau_s: float) -> str:
        return _shown(evidence[evidence.reading(each, tau_s, name)])

    lags = across(TAUS_S, "tau = {:g} s".format, shown)
    title = f"Defender {name}: E_v in percent over intact vehicles (collisions)"
    notes = (PLAYED, TEXT) if name == DEFENDERS[-1] else ()
    return ExhibitTable(title, (Column("", "name"), *lags), READINGS, notes)


def _ride(evidence: DisbandingEvidence) -> ExhibitTable:
    rides = [
        (tau_s, name, evidence[evidence.reading(READINGS[0], tau_s, name)]) for tau_s in TAUS_S for name in DEFENDERS
    ]
    return ExhibitTable("Comfort, energy and recovery in preset paper", RIDE, rides, (RIDE_NOTE,), left=2, grouped=1)


RIDE = (
    Column("tau", lambda ride: ride[0], "{:g} s"),
    Column("defender", lambda ride: ride[1]),
    Column("acceleration", lambda ride: ride[2]["acceleration_mps2"], "{:.2f} m/s2"),
    Column("jerk", lambda ride: ride[2]["jerk_mps3"], "{:.2f} m/s3"),
    Column("energy", lambda ride: ride[2]["energy_kj_per_km"], "{:.0f} kJ/km"),
    Column("recovery", lambda ride: ride[2]["recovery_s"], "{:.0f} s"),
)


def _shown(found: Mapping[str, float]) -> str:
    return f"{found['velocity_error_intact']:.2f} ({found['collided_intact']:.0f})"
