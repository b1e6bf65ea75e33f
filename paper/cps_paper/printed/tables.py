"""What the tables of the paper print, cell by cell, and Fig. 3.2 by the values of the text."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from importlib.resources import files

from cps_envs.core.errors import UnknownNameError, near
from cps_envs.fdi.sensors import Sensors, parse_sensors
from cps_envs.fdi.task import Task, make_task
from cps_paper.verdicts import ABSOLUTE, Tolerance, of_cell


@dataclass(frozen=True)
class VelocityErrorCell:
    """One cell of Table 2.2 or 2.3."""

    desired_gap_m: float
    tau_s: float
    controller: str  # baseline, heuristic or mpc
    velocity_error_percent: float
    crash: bool


def read_table(name: str) -> list[dict[str, str]]:
    """The rows of a table such as "table_2_2", as printed.

    Raises:
        UnknownNameError: there is no such table.
    """
    folder = files("cps_paper.printed")
    known = [entry.name.removesuffix(".csv") for entry in folder.iterdir() if entry.name.endswith(".csv")]
    if name not in known:
        raise UnknownNameError(f"there is no table {name!r} of the paper. {near(name, known)}")
    text = folder.joinpath(f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def velocity_errors(name: str) -> list[VelocityErrorCell]:
    """The cells of "table_2_2" or "table_2_3"."""
    return [
        VelocityErrorCell(
            desired_gap_m=float(row["desired_gap_m"]),
            tau_s=float(row["tau_s"]),
            controller=row["controller"],
            velocity_error_percent=float(row["velocity_error_percent"]),
            crash=row["crash"] == "yes",
        )
        for row in read_table(name)
    ]


@dataclass(frozen=True)
class TrackingErrorCell:
    """One cell of Table 4.1 or 4.2: the mean absolute tracking error e_i of a zone."""

    table: str  # "4.1" or "4.2"
    percent: int  # variance of the measurement noise in 0.01 C2 (4.1), range of the perturbation of A (4.2)
    sensors_used: int  # by the estimate; 0: the controller gets the measurements
    zone: int  # from 1
    mean_abs_error_c: float


def tracking_errors(table: str) -> list[TrackingErrorCell]:
    """The cells of Table "4.1" or "4.2", row by row as printed.

    Raises:
        UnknownNameError: there is no such table.
    """
    return [
        TrackingErrorCell(
            table,
            percent=_percent(row["condition"]),
            sensors_used=0 if row["source"] == "raw" else int(row["sensors_used"]),
            zone=int(row["zone"]),
            mean_abs_error_c=float(row["mean_abs_error_c"]),
        )
        for row in read_table(f"table_{table.replace('.', '_')}")
    ]


def _percent(condition: str) -> int:
    (number,) = re.findall(r"(\d+)%", condition)
    return int(number)


POINTS = Tolerance(2.0, ABSOLUTE)  # of velocity errors in percent; chosen


def verdict(difference: float) -> str:
    """`match`, `near` (within twice POINTS) or `miss` for a difference in points of velocity error."""
    return of_cell(difference, 0.0, POINTS)


TABLE_VEHICLES = {"3.1": 4, "3.2": 4, "3.3": 4, "3.4": 4, "3.5": 4, "3.6": 4, "3.7": 5}  # n


@dataclass(frozen=True)
class CollisionCell:
    """One cell of Tables 3.1 to 3.7."""

    table: str
    task: Task
    speeds_mps: tuple[tuple[int, float], ...]  # (i, e_v,i) of every pair (i, i + 1) listed; closing < 0; none for "-"

    @property
    def feasible(self) -> bool:
        """Whether the paper prints a collision of the target."""
        return bool(self.speeds_mps)

    @property
    def pairs(self) -> tuple[int, ...]:
        """The pairs listed, by their rear vehicle."""
        return tuple(pair for pair, _ in self.speeds_mps)

    @property
    def target_speed_mps(self) -> float | None:
        """Relative speed of the target's own pair, closing < 0; None where none is printed."""
        return dict(self.speeds_mps).get(self.task.target)

    @property
    def name(self) -> str:
        """Where it stands, without the table."""
        return f"{self.task.sensors} -> V_{self.task.target}"


@dataclass(frozen=True)
class CollisionRun:
    """A run of Fig. 3.2, by the approximate values of the text."""

    panels: str  # "a;c"
    num_vehicles: int
    sensors: Sensors
    pair: int  # rear vehicle of the pair that collides
    time_s: float
    impact_speed_mps: float  # closing < 0


def collision_cells(table: str) -> list[CollisionCell]:
    """The cells of a table such as "3.1", in printed order; "-" is a cell without collisions.

    Raises:
        UnknownNameError: there is no such table.
    """
    return [
        CollisionCell(
            table,
            make_task(row["attacked"], int(row["target"]), TABLE_VEHICLES[table]),
            tuple(zip(map(_rear, _parts(row["collisions"])), map(float, _parts(row["impact_speed_mps"])), strict=True)),
        )
        for row in read_table(f"table_{table.replace('.', '_')}")
    ]


def collision_runs() -> list[CollisionRun]:
    """Both runs of Fig. 3.2."""
    return [
        CollisionRun(
            panels=row["panels"],
            num_vehicles=int(row["n"]),
            sensors=parse_sensors(row["attacked"], int(row["n"])),
            pair=_rear(row["collision"]),
            time_s=float(row["time_s"]),
            impact_speed_mps=float(row["impact_speed_mps"]),
        )
        for row in read_table("fig_3_2")
    ]


def _parts(text: str) -> list[str]:
    return text.split(";") if text else []


def _rear(pair: str) -> int:
    return int(pair.partition("-")[0])
