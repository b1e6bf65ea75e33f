"""Which sensors are attacked, in the notation of the paper's tables: `x1`, `v13`, `xv14`, `x1+v3`.

Beyond the paper `r` means the rear sensors, which measure the gap behind a vehicle: `rv2`, `xv1+rxv2`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray

KINDS = ("x", "v", "xv")  # range, range-rate, both
_GROUP = re.compile(r"(r?)(xv|x|v)(\d+(?:,\d+)*)")


@dataclass(frozen=True)
class Sensors:
    """The attacked range and range-rate sensors, by vehicle (1 = last of the platoon, n = lead), each sorted."""

    range: tuple[int, ...] = ()
    range_rate: tuple[int, ...] = ()
    rear_range: tuple[int, ...] = ()
    rear_rate: tuple[int, ...] = ()

    @property
    def count(self) -> int:
        """q, the number of attacked sensors."""
        return len(self.range) + len(self.range_rate) + len(self.rear_range) + len(self.rear_rate)

    @property
    def has_rear(self) -> bool:
        """Whether a rear sensor is attacked."""
        return bool(self.rear_range or self.rear_rate)

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The vehicles with an attacked sensor."""
        return tuple(sorted({*self.range, *self.range_rate, *self.rear_range, *self.rear_rate}))

    def flags(self, num_vehicles: int, *, rear: bool = False) -> BoolArray:
        """Marks (2n,) in the order of the readings: ranges of vehicles 1..n, then range-rates.

        With `rear` those of the rears of vehicles 2..n follow those of the fronts, ranges and rates alike: (4n - 2,).
        """
        marks = np.zeros((2, 2 * num_vehicles - 1 if rear else num_vehicles), np.bool_)
        for kind, (front, behind) in enumerate(((self.range, self.rear_range), (self.range_rate, self.rear_rate))):
            marks[kind, [i - 1 for i in front]] = True
            if rear:
                marks[kind, [num_vehicles + i - 2 for i in behind]] = True
        return marks.ravel()

    def __str__(self) -> str:
        pairs = (("", self.range, self.range_rate), ("r", self.rear_range, self.rear_rate))
        return "+".join(filter(None, (_written(*pair) for pair in pairs)))


def parse_sensors(text: str, num_vehicles: int) -> Sensors:
    """The sensors of a text: kind `x`, `v` or `xv`, then vehicles, `+` between groups: `x4`, `v1,3`, `xv14`, `x1+v3`.

    Digits without commas are one vehicle each, as in the paper's tables; in platoons of ten and more they are one
    number.

    Raises:
        ConfigurationError: not in this notation, no sensor at all, or a vehicle that does not exist.
    """
    found: dict[str, set[int]] = {"x": set(), "v": set(), "rx": set(), "rv": set()}
    for group in text.replace(" ", "").split("+"):
        match = _GROUP.fullmatch(group)
        if match is None:
            raise ConfigurationError(
                f"attacked = {text!r} names no sensors. Write the kind (x: range, v: range-rate, xv: both) and the "
                "vehicles, such as x4, v1,3, xv14 or x1+v3; r before the kind means rear sensors, such as rxv2."
            )
        for kind in match[2]:
            found[match[1] + kind].update(_vehicles(match[3], num_vehicles, text, first=2 if match[1] else 1))
    return Sensors(*(tuple(sorted(found[kind])) for kind in ("x", "v", "rx", "rv")))


def _vehicles(digits: str, num_vehicles: int, text: str, first: int) -> list[int]:
    single = "," not in digits and num_vehicles < 10
    vehicles = [int(part) for part in (digits if single else digits.split(","))]
    for vehicle in vehicles:
        if not first <= vehicle <= num_vehicles:
            raise ConfigurationError(
                f"attacked = {text!r}: vehicle {vehicle} is not one of {first} to {num_vehicles} (1 = last, n = lead)."
            )
    return vehicles


def _written(prefix: str, ranges: tuple[int, ...], rates: tuple[int, ...]) -> str:
    if ranges == rates:
        return f"{prefix}xv{_listed(ranges)}" if ranges else ""
    parts = (("x", ranges), ("v", rates))
    return "+".join(prefix + kind + _listed(vehicles) for kind, vehicles in parts if vehicles)


def _listed(vehicles: tuple[int, ...]) -> str:
    return ",".join(map(str, vehicles))
