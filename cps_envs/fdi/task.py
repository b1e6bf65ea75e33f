"""A task: which sensors are attacked, and between which vehicles the attacker wants a collision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from cps_envs.core.errors import ConfigurationError
from cps_envs.fdi.sensors import Sensors, parse_sensors


@dataclass(frozen=True)
class Task:
    """Attacked sensors and target: vehicle `target` is to hit the one ahead of it (for the lead: its reference)."""

    sensors: Sensors
    target: int

    def __str__(self) -> str:
        return f"{self.sensors}>{self.target}"


def parse_task(text: str, num_vehicles: int) -> Task:
    """The task of a text such as `x4>4` or `xv1,4>2`.

    Raises:
        ConfigurationError: not in this notation, or a vehicle that does not exist.
    """
    sensors, arrow, target = text.partition(">")
    if not arrow or not target.strip().isdecimal():
        raise ConfigurationError(f"task {text!r} must read like x4>4: attacked sensors, >, target vehicle.")
    return make_task(sensors, int(target), num_vehicles)


def make_task(attacked: str, target: int, num_vehicles: int) -> Task:
    """The task of sensors in text form and a target.

    Raises:
        ConfigurationError: no such sensors or vehicle.
    """
    if not 1 <= target <= num_vehicles:
        raise ConfigurationError(f"target = {target} is no vehicle of the platoon: 1 (last) to {num_vehicles} (lead).")
    return Task(parse_sensors(attacked, num_vehicles), target)


def all_tasks(num_vehicles: int, num_attacked: int) -> Sequence[Task]:
    """The tasks of the paper's tables with one kind of sensors on `num_attacked` vehicles, and every target."""
    return [
        make_task(kind + ",".join(map(str, vehicles)), target, num_vehicles)
        for kind in ("x", "v", "xv")
        for vehicles in combinations(range(1, num_vehicles + 1), num_attacked)
        for target in range(1, num_vehicles + 1)
    ]
