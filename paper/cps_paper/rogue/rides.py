"""Figs. 5.2 to 5.5 in numbers: courses of damage, an attacker that changes its gains, and errors in circles (5.13)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.rogue.config import PAPER, RogueConfig
from cps_paper.claims import joined
from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.rogue.course import RogueCourse
from cps_paper.rogue.experiments import RogueEvidence, swaying_ride
from cps_paper.rogue.heat_map import CIRCLED, COURSE_FREQUENCIES_HZ, SWAYS, TITLES


class Errors(NamedTuple):
    """Of a vehicle that follows the attacker, T moments from its alarm until a human takes over."""

    vehicle: int  # index, from the rear
    position_m: FloatArray  # (T,) e, to the separation that has grown
    speed_mps: FloatArray  # (T,) d


def followers(course: RogueCourse) -> list[Errors]:
    """Those of the vehicles right behind and right ahead of the attacker, as far as their alarms blame it."""
    seat, found = course.attacker, []
    human = np.logical_or.accumulate(course.human.any(axis=1))
    for vehicle, pair, side in ((seat - 1, seat - 1, 1), (seat + 1, seat, -1)):
        following = (course.alarm[:, vehicle] == side) & ~human
        wanted = course.config.separation_m + course.growth_m[:, vehicle]
        position = side * (course.separation_m[:, pair] - wanted)
        speed = side * np.diff(course.speed_mps, axis=1)[:, pair]
        if following.any():
            found.append(Errors(vehicle, position[following], speed[following]))
    return found


def radii_m(config: RogueConfig) -> list[float]:
    """r_1 to r_4 of (5.13)."""
    shares = (config.inner_share, config.middle_share, config.outer_share, 1.0)
    return [share * config.separation_m for share in shares]


def shares_of_rings(errors: Errors, config: RogueConfig) -> FloatArray:
    """The shares of the time (5,) within r_1, between it and r_2, ..., and beyond r_4."""
    rings = np.searchsorted(radii_m(config), np.hypot(errors.position_m, errors.speed_mps), side="right")
    shares: FloatArray = np.bincount(rings, minlength=5) / len(rings)
    return shares


def affected(errors: Errors, config: RogueConfig) -> BoolArray:
    """Whether a_m makes a difference (T,) at the speed v_ref: only deep within the boundary layer.

    Elsewhere even the least command, a share of 2 k_1 v_max + n_3 a_max + epsilon, is more than the actuator gives.
    """
    surface = config.surface_slope_per_s * errors.position_m + errors.speed_mps
    share = np.clip(surface / config.boundary_layer_mps, -1.0, 1.0)
    base = 2 * config.surface_slope_per_s * config.max_speed_mps + config.boundary_layer_mps
    weakest, strongest = (share * (base + part * config.max_acceleration_mps2) for part in (config.inner_share, 1.0))
    speed = bounds(config.reference_speed_mps)[0]
    drive, drag = bounds(config.drive_mps2)[0], bounds(config.drag_per_s)[0]
    limits = drive * config.min_effort - drag * speed, drive * config.max_effort - drag * speed
    differs: BoolArray = np.clip(weakest, *limits) != np.clip(strongest, *limits)
    return differs


Ride = tuple[str, float, RogueCourse]  # defender or attacker, Hz


def courses_table(evidence: RogueEvidence, number: str, defenders: Sequence[str]) -> ExhibitTable:
    """Fig. 5.3 or 5.5."""
    rides = [(name, each, evidence.course(name, each)) for name in defenders for each in COURSE_FREQUENCIES_HZ]
    note = "The paper shows curves without naming their frequency. Attacker of equal power, contact pass, D in m."
    title = f"Fig. {number}: damage at equal power"
    return ExhibitTable(title, COURSE_COLUMNS, rides, (note,), grouped=1, data=_course_data)


def _course_data(ride: Ride) -> dict[str, Any]:
    """Damage and the leader's distance behind its reference, second by second."""
    defender, frequency_hz, course = ride
    moments = [course.at(second) for second in range(int(course.config.duration_s) + 1)]
    return {
        "defender": defender,
        "frequency_hz": frequency_hz,
        "damage": course.damage[moments].tolist(),
        "leader_behind_m": course.behind_m[moments, -1].tolist(),
        "disbanded_s": course.disbanded_s,
    }


def _alarm_s(course: RogueCourse) -> float | None:
    alarms = course.time_s[(course.alarm != 0).any(axis=1)]
    return float(alarms[0]) if len(alarms) else None


COURSE_COLUMNS = (
    Column("", lambda ride: TITLES[ride[0]]),
    Column("f, Hz", lambda ride: ride[1], "{:g}"),
    Column("D at 25 s", lambda ride: ride[2].damage[ride[2].at(25.0)], "{:.1f}"),
    Column("D at 100 s", lambda ride: ride[2].final_damage, "{:.1f}"),
    Column("alarm, s", lambda ride: _alarm_s(ride[2]), "{:.1f}"),
    Column("disbanded, s", lambda ride: ride[2].disbanded_s, "{:.1f}"),
    Column("leader behind, m", lambda ride: ride[2].behind_m[-1, -1], "{:.0f}"),
    Column("slowest, m/s", lambda ride: ride[2].speed_mps[-1, ride[2].intact].min(), "{:.1f}"),
)


PARTS = 3  # of the time


def sways_table(evidence: RogueEvidence) -> ExhibitTable:
    """Fig. 5.2."""
    rides = [(attacker, evidence[swaying_ride(attacker, ratio)]) for attacker, ratio in SWAYS]
    title = "Fig. 5.2: an attacker that changes its gains"
    return ExhibitTable(title, SWAY_COLUMNS, rides, SWAY_NOTES, data=_sway_data)


def _sway_data(ride: tuple[str, RogueCourse]) -> dict[str, Any]:
    """Places relative to those on the reference, and the damage, decision by decision."""
    attacker, course = ride
    ratio = course.config.power_ratio
    return {
        "attacker": attacker,
        "power_ratio": ratio,
        "ahead_m": (-course.behind_m).tolist(),
        "damage": course.damage.tolist(),
    }


def gap_errors_m(course: RogueCourse) -> list[float]:
    """The largest error of a gap in each third of the time, m."""
    errors = np.abs(course.separation_m - course.config.separation_m).max(axis=1)
    return [float(part.max()) for part in np.array_split(errors, PARTS)]


def closing_speeds_mps(course: RogueCourse) -> list[float]:
    """Of each collision of two solid bodies, m/s: what the damage of their pair rises by."""
    rises = np.diff(course.pair_damage, axis=0)
    return [float(rise) for rise in rises[rises > 0]]


def _at_contact(course: RogueCourse) -> tuple[float | None, float | None, float | None]:
    """When the first contact is, its closing speed, and the fastest vehicle then."""
    hits = np.flatnonzero(course.damage > 0)
    if not len(hits):
        return None, None, None
    first = hits[0]
    return float(course.time_s[first]), float(course.damage[first]), float(course.speed_mps[first - 1].max())


SWAY_COLUMNS = (
    Column("attacker", lambda ride: ride[0], "`{}`"),
    Column("ratio", lambda ride: ride[1].config.power_ratio, "{:g}"),
    Column("gap errors in thirds, m", lambda ride: joined(gap_errors_m(ride[1]))),
    Column("first contact, s", lambda ride: _at_contact(ride[1])[0], "{:.1f}"),
    Column("its closing speed, m/s", lambda ride: _at_contact(ride[1])[1], "{:.1f}"),
    Column("fastest then, m/s", lambda ride: _at_contact(ride[1])[2], "{:.1f}"),
    Column("collisions", lambda ride: len(closing_speeds_mps(ride[1]))),
    Column("D, m/s", lambda ride: ride[1].final_damage, "{:.1f}"),
    Column("least gap, m", lambda ride: ride[1].separation_m.min() - ride[1].config.vehicle_length_m, "{:.1f}"),
)
SWAY_NOTES = (
    "Preset oscillation, the last row: ten vehicles by the linear law (5.15), the attacker at the rear, solid bodies. "
    "After one second at full effort it drives by (5.15) too: with the platoon's gains, or with the sign of k_d "
    "reversed. The rows above have another attacker or less power.",
    "The paper names neither the gains nor the platoon of this figure, which is from an earlier study.",
)


def circles_table(evidence: RogueEvidence) -> ExhibitTable:
    """Fig. 5.4: shares of the time in its circles."""
    radii = radii_m(PAPER)
    rings = (f"below {radii[0]:g} m", *(f"to {radius:g} m" for radius in radii[1:]), "beyond")
    columns = (
        Column("vehicle", lambda each: each[2].vehicle + 1),
        Column("f, Hz", lambda each: each[0], "{:g}"),
        *across(range(5), rings.__getitem__, lambda each, k: shares_of_rings(each[2], each[1].config)[k], "{:.0%}"),
        Column("a_m matters", lambda each: float(affected(each[2], each[1].config).mean()), "{:.1%}"),
    )
    courses = [(each, evidence.course(CIRCLED, each)) for each in COURSE_FREQUENCIES_HZ]
    records = [(each, course, errors) for each, course in courses for errors in followers(course)]
    title = "Fig. 5.4: how long the errors are in which circle"
    return ExhibitTable(title, columns, records, CIRCLE_NOTES, left=2, data=_circle_data)


def _circle_data(record: tuple[float, RogueCourse, Errors]) -> dict[str, Any]:
    frequency_hz, course, errors = record
    return {
        "frequency_hz": frequency_hz,
        "vehicle": errors.vehicle + 1,
        "shares": shares_of_rings(errors, course.config).tolist(),
        "affected": float(affected(errors, course.config).mean()),
    }


CIRCLE_NOTES = (
    f"{TITLES[CIRCLED]}, contact pass, equal power: the vehicles next to the attacker, from their alarm until "
    "human drivers take over; 1 m/s counts as 1 m. Errors to the separation that has grown.",
    "a_m matters: share of the time in which n_3 a_max and a_max lead to different efforts.",
)
