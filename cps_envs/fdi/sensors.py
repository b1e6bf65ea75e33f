"""Which front sensors are attacked, in the notation of the paper's tables: `x1`, `v13`, `xv14`, `x1+v3`."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray

KINDS = ("x", "v", "xv")  # range, range-rate, both
_GROUP = re.compile(r"(xv|x|v)(\d+(?:,\d+)*)")


@dataclass(frozen=True)
class Sensors:
    """The attacked range and range-rate sensors, by vehicle (1 = last of the platoon, n = lead), each sorted."""

    range: tuple[int, ...] = ()
    range_rate: tuple[int, ...] = ()

    @property
    def count(self) -> int:
        """q, the number of attacked sensors."""
        return len(self.range) + len(self.range_rate)

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The vehicles with an attacked sensor."""
        return tuple(sorted({*self.range, *self.range_rate}))

    def flags(self, num_vehicles: int) -> BoolArray:
        """Marks (2n,) in the order of the readings: ranges of vehicles 1..n, then range-rates."""
        marks = np.zeros(2 * num_vehicles, np.bool_)
        marks[[i - 1 for i in self.range]] = True
        marks[[num_vehicles + i - 1 for i in self.range_rate]] = True
        return marks

    def __str__(self) -> str:
        if self.range == self.range_rate:
            return "xv" + _listed(self.range)
        parts = (("x", self.range), ("v", self.range_rate))
        return "+".join(kind + _listed(vehicles) for kind, vehicles in parts if vehicles)


def parse_sensors(text: str, num_vehicles: int) -> Sensors:
    """The sensors of a text: kind `x`, `v` or `xv`, then vehicles, `+` between groups: `x4`, `v1,3`, `xv14`, `x1+v3`.

    Digits without commas are one vehicle each, as in the paper's tables; in platoons of ten and more they are one
    number.

    Raises:
        ConfigurationError: not in this notation, no sensor at all, or a vehicle that does not exist.
    """
    found: dict[str, set[int]] = {"x": set(), "v": set()}
    for group in text.replace(" ", "").split("+"):
        match = _GROUP.fullmatch(group)
        if match is None:
            raise ConfigurationError(
                f"attacked = {text!r} names no sensors. Write the kind (x: range, v: range-rate, xv: both) and the "
                "vehicles, such as x4, v1,3, xv14 or x1+v3."
            )
        for kind in match[1]:
            found[kind].update(_vehicles(match[2], num_vehicles, text))
    return Sensors(tuple(sorted(found["x"])), tuple(sorted(found["v"])))


def _vehicles(digits: str, num_vehicles: int, text: str) -> list[int]:
    single = "," not in digits and num_vehicles < 10
    vehicles = [int(part) for part in (digits if single else digits.split(","))]
    for vehicle in vehicles:
        if not 1 <= vehicle <= num_vehicles:
            raise ConfigurationError(
                f"attacked = {text!r}: vehicle {vehicle} is not one of 1 to {num_vehicles} (1 = last, n = lead)."
            )
    return vehicles


def _listed(vehicles: tuple[int, ...]) -> str:
    return ",".join(map(str, vehicles))
