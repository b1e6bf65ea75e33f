"""The parts that are played in the environment, as tables of text."""

from __future__ import annotations

from collections.abc import Mapping

from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.experiments import PLATOONS, TAUS_S
from cps_baselines.disbanding.reproduction.played import DEFENDERS, READINGS, RIDE
from cps_baselines.reproduction.block import Block

PLAYED = (
    "N = 10 where nothing else is said, x_d = 5 m. The lead platoon is disbanded at 1 s. Defenders act every 0.1 s, "
    "where `heuristic` is weaker than at every integration step. Collisions: intact vehicles that are involved in one."
)
TEXT = (
    "A sensor: one vehicle is attacked and alerts its platoon link by link (2.2.2); all drivers take over at once in "
    "`paper`. The last two rows are means over 20 seeds."
)
COLUMNS = ("acceleration", "jerk", "energy", "recovery")
UNITS = ("m/s2", "m/s3", "kJ/km", "s")
RIDE_NOTE = (
    "Of the vehicles of intact platoons: root mean squares of acceleration and of its changes within 0.1 s, traction "
    "of a passenger car (522 kJ/km at a steady 31 m/s), and the time from the attack until all keep within 10 % of the "
    "desired speed; 179 s means that the episode ends before."
)


def platoons_blocks(evidence: Evidence) -> list[Block]:
    """E_v and collisions over N, one table per tau."""
    return [_platoons(evidence, tau_s) for tau_s in TAUS_S]


def _platoons(evidence: Evidence, tau_s: float) -> Block:
    rows = [
        (str(count), *(_shown(evidence[evidence.experiments.defended(count, tau_s, name)]) for name in DEFENDERS))
        for count in PLATOONS
    ]
    title = f"tau = {tau_s:g} s, N platoons: E_v in percent over intact vehicles (collisions)"
    return Block(title, ("N", *DEFENDERS), rows, notes=(PLAYED,) if tau_s == TAUS_S[-1] else ())


def text_blocks(evidence: Evidence) -> list[Block]:
    """E_v and collisions under each reading of the text, one table per defender, and what passengers feel."""
    return [*(_readings(evidence, name) for name in DEFENDERS), _ride(evidence)]


def _readings(evidence: Evidence, name: str) -> Block:
    rows = [
        (each.name, *(_shown(evidence[evidence.experiments.reading(each, tau_s, name)]) for tau_s in TAUS_S))
        for each in READINGS
    ]
    title = f"Defender {name}: E_v in percent over intact vehicles (collisions)"
    notes = (PLAYED, TEXT) if name == DEFENDERS[-1] else ()
    return Block(title, ("", *(f"tau = {tau_s:g} s" for tau_s in TAUS_S)), rows, notes=notes)


def _ride(evidence: Evidence) -> Block:
    rows = []
    for tau_s in TAUS_S:
        for name in DEFENDERS:
            found = evidence[evidence.experiments.reading(READINGS[0], tau_s, name)]
            values = (
                f"{found[key]:.{digits}f} {unit}" for key, unit, digits in zip(RIDE, UNITS, (2, 2, 0, 0), strict=True)
            )
            rows.append((f"{tau_s:g} s", name, *values))
    columns = ("tau", "defender", *COLUMNS)
    breaks = tuple(k * len(DEFENDERS) - 1 for k in range(1, len(TAUS_S)))
    return Block("Comfort, energy and recovery in preset paper", columns, rows, 2, (RIDE_NOTE,), breaks)


def _shown(found: Mapping[str, float]) -> str:
    return f"{found['velocity_error_intact']:.2f} ({found['collided_intact']:.0f})"
