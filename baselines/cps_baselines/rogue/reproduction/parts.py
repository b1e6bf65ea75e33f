"""The parts of the chapter that can be asked for, and what each needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any

from cps_baselines.reproduction.evidence import Experiment
from cps_baselines.rogue.reproduction.claims_courses import EARLY_DISBANDING, ENDS
from cps_baselines.rogue.reproduction.evidence import (
    calm_ride,
    map_rows,
    searched_ride,
    seat_overrides,
    square_ride,
    steady_waves,
    swaying_ride,
)
from cps_baselines.rogue.reproduction.fit import FURTHER
from cps_baselines.rogue.reproduction.headroom import head_room_experiments
from cps_baselines.rogue.reproduction.reference import references
from cps_baselines.rogue.reproduction.settings import (
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    DISBANDING,
    FREQUENCIES_HZ,
    MAPS,
    PASS,
    SEAT_RATIOS,
    SEATED,
    SEATS,
    SWAYS,
)
from cps_envs.core.errors import ConfigurationError, near

PARTS = {
    "5.2": "Fig. 5.2: an attacker at the rear of ten vehicles that changes the gains of its controller",
    "5.3": "Fig. 5.3: the sliding mode without and with detection, at equal power",
    "5.4": "Fig. 5.4: the circles of the modified sliding mode, and where the errors are",
    "5.5": "Fig. 5.5: disbanding at +2 m, at equal power",
    "maps": "Figs. 5.6 to 5.11: damage over frequency and power",
    "seats": "such maps for every seat of the attacker and platoons of ten; beside them detection over the linear law",
    "claims": "everything that the text claims, one by one",
    "fit": "how selected the configuration is",
    "headroom": "what square waves and searched attackers can do in the learning problem",
}
LONG = ("seats", "fit", "headroom")  # left out by --quick
CIRCLED = "disband_7"  # whose errors Fig. 5.4 shows
COURSES = {"5.3": ("sliding", "sliding_detection"), "5.5": ("disband_2",)}


def chosen(parts: Iterable[str], *, quick: bool = False) -> tuple[str, ...]:
    """The parts asked for in their usual order; if none is named all of them, with `quick` without the long ones.

    Raises:
        ConfigurationError: a part that does not exist.
    """
    wanted = list(parts)
    for part in wanted:
        if part not in PARTS:
            raise ConfigurationError(f"chapter 5 has no part {part!r}. {near(part, PARTS)} Known: {', '.join(PARTS)}.")
    default = [part for part in PARTS if not (quick and part in LONG)]
    return tuple(part for part in PARTS if part in (wanted or default))


def needed(parts: Sequence[str]) -> list[Experiment[Any]]:
    """The experiments behind these parts, some twice, and those behind the regression check."""
    todo: list[Experiment[Any]] = [each.experiment for each in references() if each.experiment is not None]
    for part, defenders in COURSES.items():
        if part in parts:
            todo += [square_ride(name, each, PASS) for name in defenders for each in COURSE_FREQUENCIES_HZ]
    if "5.2" in parts:
        todo += [swaying_ride(attacker) for attacker in SWAYS]
    if "5.4" in parts:
        todo += [square_ride(CIRCLED, each, PASS) for each in COURSE_FREQUENCIES_HZ]
    if "seats" in parts:
        todo += _seats()
    if {"maps", "fit"} & set(parts):
        todo += _maps()
    if "claims" in parts:
        todo += behind_claims()
    if "fit" in parts:
        todo += [each for variant in FURTHER for each in variant.experiments()]
    if "headroom" in parts:
        todo += head_room_experiments()
    return todo


def behind_claims() -> list[Experiment[Any]]:
    """What the claims need."""
    return _maps() + [each for contact in CONTACTS for each in _claimed(contact)]


def _maps() -> list[Experiment[Any]]:
    return [row for contact in CONTACTS for name in MAPS.values() for row in map_rows(name, contact)]


def _seats() -> list[Experiment[Any]]:
    return [
        row
        for num_vehicles, seats in SEATS.items()
        for contact, seat, name in product(CONTACTS, seats, SEATED)
        for row in map_rows(name, contact, SEAT_RATIOS, seat_overrides(num_vehicles, seat))
    ]


def _claimed(contact: str) -> list[Experiment[Any]]:
    """What the claims need beyond the maps."""
    todo: list[Experiment[Any]] = [
        square_ride(name, each, contact) for name in MAPS.values() for each in COURSE_FREQUENCIES_HZ
    ]
    todo.append(calm_ride("disband_2", contact))
    todo += [square_ride("disband_2", each, contact, human_returns=True) for each in COURSE_FREQUENCIES_HZ]
    todo += [square_ride(name, FREQUENCIES_HZ[0], contact, ratio) for name in EARLY_DISBANDING for ratio in ENDS]
    todo += [searched_ride(name, contact) for name in DISBANDING]
    return todo + [steady_waves(name, contact) for name in ("pd", "sliding", "sliding_detection")]
