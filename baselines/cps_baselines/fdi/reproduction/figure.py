"""Fig. 3.2: our runs beside what the text says, and what may be concluded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_baselines.fdi.reproduction.course import Collision, Course
from cps_baselines.fdi.reproduction.variants import VARIANTS, FigureRun, figure_runs
from cps_baselines.paper.collisions import CollisionRun
from cps_baselines.reproduction.evidence import Evidence

ROUGH, FAR = "rough", "far"
FACTOR = 2.0  # in time and in speed; chosen


@dataclass(frozen=True)
class FigureRow:
    """One run beside the paper's."""

    run: FigureRun
    course: Course

    @property
    def paper(self) -> CollisionRun:
        """What the text says."""
        return self.run.paper

    @property
    def collision(self) -> Collision | None:
        """Ours."""
        return self.course.collision

    @property
    def time_difference(self) -> float | None:
        """Relative to the paper's time; None without a collision."""
        return None if self.collision is None else self.collision.time_s / self.paper.time_s - 1.0

    @property
    def speed_difference(self) -> float | None:
        """Relative to the paper's impact speed; None without a collision."""
        return None if self.collision is None else self.collision.impact_speed_mps / self.paper.impact_speed_mps - 1.0

    @property
    def pair_agrees(self) -> bool:
        """Whether the same two vehicles collide."""
        return self.collision is not None and self.collision.pair == self.paper.pair

    @property
    def verdict(self) -> str:
        """Time and speed within FACTOR, or not."""
        shares = (self.time_difference, self.speed_difference)
        if all(share is not None and 1.0 / FACTOR <= 1.0 + share <= FACTOR for share in shares):
            return ROUGH
        return FAR


def figure_rows(evidence: Evidence) -> list[FigureRow]:
    """All variants, as far as they were run."""
    return [FigureRow(run, evidence[run]) for run in figure_runs()]


def main_rows(rows: Sequence[FigureRow]) -> list[FigureRow]:
    """Those of the preset fig32 as it stands."""
    return [row for row in rows if row.run.variant == VARIANTS[0]]
