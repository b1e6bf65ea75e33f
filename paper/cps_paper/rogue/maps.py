"""Figs. 5.6 to 5.11 in numbers for both contacts, the collision line, and such maps for other seats."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

from cps_envs.rogue.config import PAPER
from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.rogue.experiments import RogueEvidence, seat_overrides
from cps_paper.rogue.heat_map import (
    CONTACTS,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    SEAT_RATIOS,
    SEATED,
    SEATS,
    TITLES,
    HeatMap,
    bumper_gap_m,
    collision_frequency_hz,
)

Seat = tuple[int, int, str]  # vehicles, seat from the rear, defender


def maps_tables(evidence: RogueEvidence) -> list[ExhibitTable]:
    """All maps, and the collision line for both readings of the gap."""
    columns = [Column("Fig.", lambda each: each[0]), Column("", lambda each: TITLES[each[1]])]
    for contact in CONTACTS:
        columns += _numbers(evidence.under(contact), lambda there, each: there.map(each[1]))
    axes = (
        f"{len(FREQUENCIES_HZ)} frequencies from {FREQUENCIES_HZ[0]:g} to {FREQUENCIES_HZ[-1]:g} Hz and power ratios "
        f"{', '.join(f'{ratio:g}' for ratio in RATIOS)}, both chosen; {PAPER.duration_s:g} s, chosen."
    )
    notes = ("The paper prints colours without a scale and no number, so what it says is checked claim by claim.", axes)
    gaps = ((bumper_gap_m(), "bumpers, drawn solid"), (PAPER.separation_m, "centres, as printed, drawn dashed"))
    return [
        ExhibitTable("Figs. 5.6 to 5.11: total damage", columns, list(MAPS.items()), notes, left=2),
        ExhibitTable("Collision line, Hz", LINE_COLUMNS, gaps),
    ]


def maps_data(evidence: RogueEvidence) -> dict[str, Any]:
    """Every cell, and the collision line for both gaps, for JSON."""
    maps = [
        {
            "figure": figure,
            "defender": defender,
            "contact": contact,
            "unit": unit,
            "maximum": heat_map.highest,
            "mean": heat_map.mean,
            "peak": heat_map.peak,
            "ratios": list(heat_map.ratios),
            "frequencies_hz": list(heat_map.frequencies_hz),
            "damage": heat_map.damage.tolist(),
        }
        for contact, unit in CONTACTS.items()
        for figure, defender in MAPS.items()
        for heat_map in [evidence.under(contact).map(defender)]
    ]
    gaps = {"bumpers": bumper_gap_m(), "centres": PAPER.separation_m}
    line = {name: [collision_frequency_hz(ratio, gap_m) for ratio in RATIOS] for name, gap_m in gaps.items()}
    return {"maps": maps, "collision_line_hz": {"ratios": list(RATIOS), **line}}


def seats_table(evidence: RogueEvidence) -> ExhibitTable:
    """The maps of other seats and platoons."""
    columns = [
        Column("vehicles", lambda each: each[0]),
        Column("seat", lambda each: each[1]),
        Column("", lambda each: TITLES[each[2]]),
    ]
    for contact in CONTACTS:
        columns += _numbers(evidence.under(contact), _seat_map)[:2]
    notes = (
        f"Seat 1 is the rear. {len(FREQUENCIES_HZ)} frequencies, power ratios "
        f"{', '.join(f'{ratio:g}' for ratio in SEAT_RATIOS)}; the paper's attacker has seat 3 of 5.",
    )
    return ExhibitTable("The attacker in other seats", columns, every_seat(), notes, left=3, grouped=2)


def seats_data(evidence: RogueEvidence) -> list[dict[str, Any]]:
    """Every cell of the same maps, for JSON."""
    return [
        {
            "num_vehicles": each[0],
            "seat": each[1],
            "defender": each[2],
            "contact": contact,
            "unit": unit,
            "ratios": list(SEAT_RATIOS),
            "frequencies_hz": list(FREQUENCIES_HZ),
            "damage": _seat_map(evidence.under(contact), each).damage.tolist(),
        }
        for each in every_seat()
        for contact, unit in CONTACTS.items()
    ]


def every_seat() -> list[Seat]:
    """Who plays with the attacker where."""
    return [(vehicles, seat, name) for vehicles, seats in SEATS.items() for seat, name in product(seats, SEATED)]


def _seat_map(there: RogueEvidence, seat: Seat) -> HeatMap:
    return there.map(seat[2], SEAT_RATIOS, seat_overrides(seat[0], seat[1]))


def _numbers(there: RogueEvidence, of: Callable[[RogueEvidence, Any], HeatMap]) -> list[Column]:
    """Maximum and mean of a map under a contact, and where the maximum is."""
    return [
        Column(f"{there.contact}: maximum", lambda each: of(there, each).highest, "{:.1f}"),
        Column(f"mean, {CONTACTS[there.contact]}", lambda each: of(there, each).mean, "{:.1f}"),
        Column("at", lambda each: of(there, each).peak, "{:g} Hz, {:g}"),
    ]


LINE_COLUMNS = (
    Column("gap", lambda gap: gap, "{:g} m, {}"),
    *across(RATIOS, "ratio {:g}".format, lambda gap, ratio: collision_frequency_hz(ratio, gap[0]), "{:.3f}"),
)
