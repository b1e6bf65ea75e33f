"""Tables 3.1 to 3.7, cell by cell: what the paper prints, what we find, and how they compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_baselines.fdi.grid import GridCell
from cps_baselines.fdi.reproduction.experiments import GridRun
from cps_baselines.fdi.reproduction.settings import Settings
from cps_baselines.paper.collisions import CollisionCell, collision_cells
from cps_baselines.reproduction.evidence import Evidence

SAME_SPEED = 0.10  # relative difference; chosen
MATCH, NEAR, MISS = "match", "near", "miss"
RULES = (
    "Verdicts. match: no collision in both, or the same pairs with the target's speed within 10 %. near: a collision "
    "of the target in both, of other pairs or at another speed. miss: a collision in one of them only."
)


@dataclass(frozen=True)
class Cell:
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
        difference, paper = self.speed_difference_mps, self.paper.target_speed_mps
        return difference is not None and paper is not None and abs(difference) <= SAME_SPEED * abs(paper)

    @property
    def verdict(self) -> str:
        """By RULES."""
        if not self.feasibility_agrees:
            return MISS
        return MATCH if not self.both_feasible or (self.pairs_agree and self.speed_agrees) else NEAR


def table_cells(evidence: Evidence, settings: Settings, table: str) -> list[Cell]:
    """The cells of a table in printed order.

    Raises:
        NotRunError: the table was left out.
    """
    return [Cell(paper, evidence[GridRun(settings, table, paper.task)]) for paper in collision_cells(table)]


def grid_runs(settings: Settings, table: str) -> Sequence[GridRun]:
    """The experiments behind a table."""
    return [GridRun(settings, table, paper.task) for paper in collision_cells(table)]
