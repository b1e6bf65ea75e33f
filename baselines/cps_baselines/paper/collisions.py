"""Reading Tables 3.1 to 3.7 and Fig. 3.2: which pairs collide under which false data, and how fast."""

from __future__ import annotations

from dataclasses import dataclass

from cps_baselines.paper.tables import read_table
from cps_envs.fdi.sensors import Sensors, parse_sensors
from cps_envs.fdi.task import Task, make_task

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
