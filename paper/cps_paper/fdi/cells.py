"""Tables 3.1 to 3.7, cell by cell: what the paper prints, what is certified, and how they compare."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import Record
from cps_paper.evidence import NotRunError
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.course import pair_name
from cps_paper.fdi.experiments import CircleRun, FdiEvidence, FdiSettings
from cps_paper.fdi.grid import GridEnd, collisions
from cps_paper.printed.tables import CollisionCell, collision_cells
from cps_paper.verdicts import MATCH, MISS, NEAR, OPEN, Tolerance

SAME_SPEED = Tolerance(0.10)  # chosen
RULES = (
    "Verdicts. match: no collision of the target in both, or one in both, the same pairs, and the target's best attack "
    "within 10 % of the printed speed. near: a collision of the target in both, of other pairs or at another speed. "
    "miss: in one of them only. open: the search ended before it could tell, or the best attack lies in a gap that "
    "decides; it counts neither way."
)
CELL_NOTES = (
    "e_v in m/s by pair, closing < 0. best: the certified best attack, from the best one known to the bound. hit: "
    "whether a legal plan ends in the acceptance circle of a grid speed.",
    RULES,
)
ROUNDING_MPS = 1e-4  # of certificates


@dataclass(frozen=True)
class CollisionPair:
    """A printed cell beside ours."""

    paper: CollisionCell
    config: FdiConfig
    ours: GridEnd
    best: Record

    @property
    def open(self) -> bool:
        """Whether the search could not tell if the target can be hit."""
        return self.ours.hit is None

    @property
    def feasibility_agrees(self) -> bool:
        """Whether both have a collision of the target, or neither has; what is open does not agree."""
        return self.ours.hit is self.paper.feasible

    @property
    def both_feasible(self) -> bool:
        """Whether both have a collision of the target."""
        return self.ours.hit is True and self.paper.feasible

    @property
    def pairs(self) -> tuple[int, ...]:
        """The pairs that collide with the best attack known, or with the plan in the circle where there is none."""
        plan = self.ours.injections if self.best.injections is None else self.best.injections
        return () if plan is None else collisions(self.config, self.paper.task, plan)

    @property
    def pairs_agree(self) -> bool:
        """Whether both list the same pairs."""
        return self.both_feasible and set(self.pairs) == set(self.paper.pairs)

    @property
    def pairs_included(self) -> bool:
        """Whether ours has all pairs that the paper lists."""
        return self.both_feasible and set(self.pairs) >= set(self.paper.pairs)

    @property
    def speed_agrees(self) -> bool | None:
        """Whether the fastest attack is within SAME_SPEED of the printed speed; None: the gap decides."""
        paper = self.paper.target_speed_mps
        if paper is None:
            return False
        lowest, highest = self.best.value_mps or 0.0, self.best.bound_mps
        ends = [SAME_SPEED.admits(speed, -paper) for speed in (lowest, highest)]
        inside = lowest <= -paper <= highest
        return ends[0] if ends[0] == ends[1] and (ends[0] or not inside) else None

    @property
    def beyond(self) -> bool:
        """Whether the printed speed is higher than any attack of the game."""
        paper = self.paper.target_speed_mps
        return paper is not None and -paper > self.best.bound_mps + ROUNDING_MPS

    @property
    def verdict(self) -> str:
        """By RULES."""
        if self.open:
            return OPEN
        if not self.feasibility_agrees:
            return MISS
        if not self.both_feasible:
            return MATCH
        if not self.pairs_agree or self.speed_agrees is False:
            return NEAR
        return OPEN if self.speed_agrees is None else MATCH


def circle_runs(settings: FdiSettings, table: str) -> Sequence[CircleRun]:
    """The experiments behind a table."""
    return [CircleRun(settings, table, paper.task) for paper in collision_cells(table)]


def table_cells(evidence: FdiEvidence, table: str) -> list[CollisionPair]:
    """The cells of a table in printed order.

    Raises:
        NotRunError: the table was left out.
    """
    settings = evidence.settings
    config, best = settings.config(table), settings.certificates(table)
    runs = zip(collision_cells(table), circle_runs(settings, table), strict=True)
    return [CollisionPair(paper, config, evidence[run], best[paper.task]) for paper, run in runs]


def solved(evidence: FdiEvidence) -> dict[str, list[CollisionPair]]:
    """The cells of all tables that were not left out."""
    found = {}
    for table in evidence.settings.tables:
        with suppress(NotRunError):
            found[table] = table_cells(evidence, table)
    return found


def cells_table(evidence: FdiEvidence, table: str) -> ExhibitTable:
    """A table cell by cell; how to read them stands under the last one."""
    settings = evidence.settings
    config = settings.config(table)
    title = f"Table {table}: n = {config.num_vehicles}, set {settings.parameters}, m = {config.horizon}"
    notes = CELL_NOTES if table == list(solved(evidence))[-1] else ()
    return ExhibitTable(title, COLUMNS, table_cells(evidence, table), notes, left=4, grouped=1, data=_data)


def hit_shown(cell: CollisionPair) -> str:
    """What the search in the circle says."""
    return "open" if cell.ours.hit is None else "yes" if cell.ours.hit else "no"


def best_shown(cell: CollisionPair) -> str | None:
    """The pairs of the best attack, and its speed or where that lies."""
    if cell.best.bound_mps == 0.0:
        return None
    lowest = "?" if cell.best.value_mps is None else f"{-cell.best.value_mps:.3f}"
    proved = cell.best.value_mps is not None and cell.best.bound_mps - cell.best.value_mps <= ROUNDING_MPS
    pairs = ", ".join(map(pair_name, cell.pairs))
    return f"{pairs} {lowest}" if proved else f"{pairs} {lowest} to {-cell.best.bound_mps:.3f}"


def _pairs(speeds_mps: Sequence[tuple[int, float]]) -> str | None:
    return "\n".join(f"{pair_name(pair)} {speed:.3f}" for pair, speed in speeds_mps) or None


def _data(cell: CollisionPair) -> dict[str, Any]:
    """For JSON; pairs by rear vehicle with relative speeds in m/s, closing < 0."""
    names = ("feasibility_agrees", "pairs_agree", "pairs_included", "speed_agrees", "beyond", "verdict")
    return {
        "attacked": str(cell.paper.task.sensors),
        "target": cell.paper.task.target,
        "paper": {pair_name(pair): speed for pair, speed in cell.paper.speeds_mps},
        "hit": cell.ours.hit,
        "end": cell.ours.end,
        "injections": cell.ours.injections,
        "pairs": list(map(pair_name, cell.pairs)),
        "value_mps": cell.best.value_mps,
        "bound_mps": cell.best.bound_mps,
        **{name: getattr(cell, name) for name in names},
    }


COLUMNS = (
    Column("", "paper.task.sensors"),
    Column("target", "paper.task.target", "V_{}"),
    Column("paper, e_v", lambda cell: _pairs(cell.paper.speeds_mps)),
    Column("best, e_v", best_shown),
    Column("hit", hit_shown),
    Column("verdict", "verdict"),
)
