"""The printed tables against one another: more attacked sensors cannot make the best impact slower."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cps_envs.fdi.sensors import Sensors
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.experiments import (
    ONE_HORIZON,
    FdiEvidence,
    RelaxedSpeeds,
    four_vehicle_cells,
)
from cps_paper.printed.tables import CollisionCell

EXAMPLES = 8
DROP = 0.10  # of the speed; what a printed speed may lose before the cells contradict one another


@dataclass(frozen=True)
class SensorComparison:
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


def comparisons() -> list[SensorComparison]:
    """Every pair of cells of Tables 3.1 to 3.6 that can be compared, in printed order of `fewer`."""
    cells = four_vehicle_cells()
    return [
        SensorComparison(fewer, more)
        for fewer in cells
        for more in cells
        if fewer.feasible
        and fewer.task.target == more.task.target
        and _strictly_within(fewer.task.sensors, more.task.sensors)
    ]


def audit_tables(evidence: FdiEvidence) -> list[ExhibitTable]:
    """The largest contradictions of the printed tables, and the largest speeds that set A cannot reach."""
    found, beyond = comparisons(), list(beyond_set_a(evidence))
    count = sum(each.contradiction for each in found)
    title = f"Audit of Tables 3.1 to 3.6: {count} of {len(found)} comparisons contradict one another; the largest"
    contradictions = ExhibitTable(title, COLUMNS, worst(found, EXAMPLES), (NOTE,), left=2)
    largest = sorted(beyond, key=lambda each: (each[1] or 0.0) + (each[0].target_speed_mps or 0.0))[:EXAMPLES]
    shares = f"{len(beyond)} of {_printed_speeds()}"
    title = f"{shares} printed speeds lie beyond the relaxation of set A at m = 20; the largest"
    note = "At most: linear program without the resolution; none: no collision."
    return [contradictions, ExhibitTable(title, BEYOND, largest, (note,), left=3)]


def audit_data(evidence: FdiEvidence) -> dict[str, Any]:
    """All contradictions, and all speeds beyond the relaxation, for JSON."""
    found = comparisons()
    return {
        "comparisons": len(found),
        "contradictions": [
            {"fewer": _stated(each.fewer), "more": _stated(each.more), "drop_mps": each.drop_mps}
            for each in found
            if each.contradiction
        ],
        "printed_speeds": _printed_speeds(),
        "beyond_relaxation": [{**_stated(cell), "at_most_mps": most} for cell, most in beyond_set_a(evidence)],
    }


def beyond_set_a(evidence: FdiEvidence) -> Iterator[tuple[CollisionCell, float | None]]:
    """Cells printed with a higher speed than set A reaches even without the resolution, and that speed in m/s.

    It is None where no collision can be reached.
    """
    fastest_mps = evidence[RelaxedSpeeds(ONE_HORIZON)]
    for cell in four_vehicle_cells():
        if cell.target_speed_mps is not None:
            fastest = fastest_mps[cell.task]
            if fastest is None or -cell.target_speed_mps > fastest:
                yield cell, fastest


def _printed_speeds() -> int:
    return sum(cell.feasible for cell in four_vehicle_cells())


def _stated(cell: CollisionCell) -> dict[str, Any]:
    return {
        "table": cell.table,
        "attacked": str(cell.task.sensors),
        "target": cell.task.target,
        "speed_mps": cell.target_speed_mps,
    }


COLUMNS = (
    Column("target", "fewer.task.target", "V_{}"),
    Column("fewer sensors", "fewer.task.sensors"),
    Column("Table", "fewer.table"),
    Column("e_v", "fewer.target_speed_mps", "{:.3f}"),
    Column("more sensors", "more.task.sensors"),
    Column("Table", "more.table"),
    Column("e_v", "more.target_speed_mps", "{:.3f}"),
    Column("lost", "drop_mps", "{:.3f}"),
)
BEYOND = (  # of cells with the highest speed within reach
    Column("Table", lambda each: each[0].table),
    Column("", lambda each: each[0].task.sensors),
    Column("target", lambda each: each[0].task.target, "V_{}"),
    Column("paper, m/s", lambda each: -(each[0].target_speed_mps or 0.0), "{:.3f}"),
    Column("at most, m/s", lambda each: "none" if each[1] is None else f"{each[1]:.3f}"),
)
NOTE = (
    "With more attacked sensors the attacker can inject nothing into the additional ones, so the best impact speed "
    'cannot fall. A contradiction: "-", or more than 10 % slower. Speeds in m/s.'
)


def worst(found: list[SensorComparison], count: int) -> list[SensorComparison]:
    """The contradictions that lose the most speed."""
    return sorted((each for each in found if each.contradiction), key=lambda each: -each.drop_mps)[:count]


def _strictly_within(fewer: Sensors, more: Sensors) -> bool:
    return fewer != more and set(fewer.range) <= set(more.range) and set(fewer.range_rate) <= set(more.range_rate)
