"""The printed tables against one another: more attacked sensors cannot make the best impact slower."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from cps_baselines.fdi.reproduction.settings import FOUR_VEHICLES
from cps_baselines.paper.collisions import CollisionCell, collision_cells
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task

DROP = 0.10  # of the speed; what a printed speed may lose before the cells contradict one another


@dataclass(frozen=True)
class Comparison:
    """Two printed cells of one target; the attacker of `more` has all sensors of `fewer` and others."""

    fewer: CollisionCell
    more: CollisionCell

    @property
    def drop_mps(self) -> float:
        """Impact speed that more sensors lose, by what is printed; a "-" counts as 0 m/s."""
        return (self.more.target_speed_mps or 0.0) - (self.fewer.target_speed_mps or 0.0)

    @property
    def contradiction(self) -> bool:
        """Whether the speed drops by more than DROP, or the collision vanishes."""
        fewer = self.fewer.target_speed_mps or 0.0
        return not self.more.feasible or self.drop_mps > DROP * abs(fewer)

    def __str__(self) -> str:
        target = f"V_{self.fewer.task.target}"
        return f"{_printed(self.fewer)}, but {_printed(self.more)} ({target})"


def comparisons() -> list[Comparison]:
    """Every pair of cells of Tables 3.1 to 3.6 that can be compared, in printed order of `fewer`."""
    cells = [cell for table in FOUR_VEHICLES for cell in collision_cells(table)]
    return [
        Comparison(fewer, more)
        for fewer in cells
        for more in cells
        if fewer.feasible
        and fewer.task.target == more.task.target
        and _strictly_within(fewer.task.sensors, more.task.sensors)
    ]


def worst(found: list[Comparison], count: int) -> list[Comparison]:
    """The contradictions that lose the most speed."""
    return sorted((each for each in found if each.contradiction), key=lambda each: -each.drop_mps)[:count]


def beyond_relaxation(fastest_mps: Mapping[Task, float | None]) -> Iterator[tuple[CollisionCell, float | None]]:
    """Feasible cells of Tables 3.1 to 3.6 printed with a higher speed than `fastest_mps`, with that speed.

    `fastest_mps` are impact speeds without the resolution (closing > 0), None where no collision can be reached.
    """
    for table in FOUR_VEHICLES:
        for cell in collision_cells(table):
            if cell.target_speed_mps is not None:
                fastest = fastest_mps[cell.task]
                if fastest is None or -cell.target_speed_mps > fastest:
                    yield cell, fastest


def _strictly_within(fewer: Sensors, more: Sensors) -> bool:
    return fewer != more and set(fewer.range) <= set(more.range) and set(fewer.range_rate) <= set(more.range_rate)


def _printed(cell: CollisionCell) -> str:
    speed = cell.target_speed_mps
    return f'{cell.task.sensors} "-"' if speed is None else f"{cell.task.sensors} {speed:.3f} m/s"
