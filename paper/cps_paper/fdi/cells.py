"""Tables 3.1 to 3.7, cell by cell: what the paper prints, what we find, and how they compare."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from cps_baselines.fdi.highs import TIME_LIMIT
from cps_paper.evidence import NotRunError
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.course import pair_name
from cps_paper.fdi.experiments import TABLES, FdiEvidence, FdiSettings, GridRun
from cps_paper.fdi.grid import GridCell
from cps_paper.printed.tables import CollisionCell, collision_cells
from cps_paper.verdicts import MATCH, MISS, NEAR, Tolerance

SAME_SPEED = Tolerance(0.10)  # chosen
RULES = (
    "Verdicts. match: no collision in both, or the same pairs with the target's speed within 10 %. near: a collision "
    "of the target in both, of other pairs or at another speed. miss: a collision in one of them only."
)
CELL_NOTES = (
    "e_v in m/s by pair, closing < 0. distance: of the end from the grid point that was accepted, else the smallest "
    "that was found. solver: no solve (the linear relaxation settles it), proved, or how many solves ended by time.",
    RULES,
)


@dataclass(frozen=True)
class CollisionPair:
    """A printed cell beside ours."""

    paper: CollisionCell
    ours: GridCell

    @property
    def feasibility_agrees(self) -> bool:
        """Whether both have a collision of the target, or neither has."""
        return self.ours.reachable == self.paper.feasible

    @property
    def both_feasible(self) -> bool:
        """Whether both have a collision of the target."""
        return self.ours.reachable and self.paper.feasible

    @property
    def pairs(self) -> tuple[int, ...]:
        """The pairs that collide in ours."""
        return tuple(pair for pair, _ in self.ours.pairs)

    @property
    def pairs_agree(self) -> bool:
        """Whether both list the same pairs."""
        return self.both_feasible and set(self.pairs) == set(self.paper.pairs)

    @property
    def pairs_included(self) -> bool:
        """Whether ours has all pairs that the paper lists."""
        return self.both_feasible and set(self.pairs) >= set(self.paper.pairs)

    @property
    def speed_difference_mps(self) -> float | None:
        """Ours minus the paper's relative speed of the target; None where one of them has none."""
        ours, paper = self.ours.speed_mps, self.paper.target_speed_mps
        return None if ours is None or paper is None else ours - paper

    @property
    def speed_agrees(self) -> bool:
        """Whether the target's speeds are within SAME_SPEED."""
        ours, paper = self.ours.speed_mps, self.paper.target_speed_mps
        return ours is not None and paper is not None and SAME_SPEED.admits(ours, paper)

    @property
    def verdict(self) -> str:
        """By RULES."""
        if not self.feasibility_agrees:
            return MISS
        return MATCH if not self.both_feasible or (self.pairs_agree and self.speed_agrees) else NEAR


def grid_runs(settings: FdiSettings, table: str) -> Sequence[GridRun]:
    """The experiments behind a table."""
    return [GridRun(settings, table, paper.task) for paper in collision_cells(table)]


def table_cells(evidence: FdiEvidence, table: str) -> list[CollisionPair]:
    """The cells of a table in printed order.

    Raises:
        NotRunError: the table was left out.
    """
    runs = zip(collision_cells(table), grid_runs(evidence.settings, table), strict=True)
    return [CollisionPair(paper, evidence[run]) for paper, run in runs]


def solved(evidence: FdiEvidence) -> dict[str, list[CollisionPair]]:
    """The cells of all tables that were not left out."""
    found = {}
    for table in TABLES:
        with suppress(NotRunError):
            found[table] = table_cells(evidence, table)
    return found


def cells_table(evidence: FdiEvidence, table: str) -> ExhibitTable:
    """A table cell by cell; how to read them stands under the last one."""
    settings = evidence.settings
    config = settings.config(table)
    title = (
        f"Table {table}: n = {config.num_vehicles}, set {settings.parameters}, m = {config.horizon}, "
        f"HiGHS, {settings.time_limit_s:g} s per solve"
    )
    notes = CELL_NOTES if table == list(solved(evidence))[-1] else ()
    return ExhibitTable(title, COLUMNS, table_cells(evidence, table), notes, left=4, grouped=1, data=_data)


def solver_shown(cell: CollisionPair) -> str:
    """How the solver settled a cell."""
    statuses = cell.ours.statuses
    if not statuses:
        return "no solve"
    limited = statuses.count(TIME_LIMIT)
    return f"{limited}/{len(statuses)} by time" if limited else "proved"


def _pairs(speeds_mps: Sequence[tuple[int, float]]) -> str | None:
    return "\n".join(f"{pair_name(pair)} {speed:.3f}" for pair, speed in speeds_mps) or None


def _data(cell: CollisionPair) -> dict[str, Any]:
    """For JSON; pairs by rear vehicle with relative speeds in m/s, closing < 0."""
    names = ("feasibility_agrees", "pairs_agree", "pairs_included", "speed_agrees", "speed_difference_mps", "verdict")
    return {
        "attacked": str(cell.paper.task.sensors),
        "target": cell.paper.task.target,
        "paper": {pair_name(pair): speed for pair, speed in cell.paper.speeds_mps},
        "ours": {pair_name(pair): speed for pair, speed in cell.ours.pairs},
        **{name: getattr(cell.ours, name) for name in ("distance", "statuses", "wall_s", "injections")},
        **{name: getattr(cell, name) for name in names},
    }


COLUMNS = (
    Column("", "paper.task.sensors"),
    Column("target", "paper.task.target", "V_{}"),
    Column("paper, e_v", lambda cell: _pairs(cell.paper.speeds_mps)),
    Column("ours, e_v", lambda cell: _pairs(cell.ours.pairs)),
    Column("distance", "ours.distance", "{:.3f}"),
    Column("solver", solver_shown),
    Column("verdict", "verdict"),
)
