"""Fig. 3.2: runs under several readings of what the paper leaves open or prints wrongly, beside what the text says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from cps_baselines.fdi.branch_and_bound import CORRECTED, PRINTED
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_paper.exhibit import DASH, Column, ExhibitTable, across
from cps_paper.fdi.course import Collision, CollisionCourse, attack_course, pair_name
from cps_paper.fdi.experiments import FdiEvidence
from cps_paper.fdi.interpretations import FIG_3_2
from cps_paper.figures import add_legend, curves, dress, new_figure, shades
from cps_paper.printed.tables import CollisionRun, collision_runs

ROUGH, FAR = "rough", "far"
FACTOR = 2.0  # in time and in speed; chosen
LEAD = FIG_3_2.num_vehicles
LONG = replace(FIG_3_2, proportional_gain=1.0, dt_s=0.1, horizon=FIG_3_2.horizon // 2)


@dataclass(frozen=True)
class FigureVariant:
    """One way to run Fig. 3.2."""

    name: str
    meaning: str
    config: FdiConfig = FIG_3_2
    gap_sign: float = CORRECTED
    ignored_pair: int | None = None  # may collide without ending the run


VARIANTS = (
    FigureVariant("fig32", "k_p 2, k_d 3, dt 0.05 s"),
    FigureVariant("k_d 5", "the same with k_d 5", replace(FIG_3_2, derivative_gain=5.0)),
    FigureVariant("k_p 1", "k_p 1, k_d 3, dt 0.1 s", LONG),
    FigureVariant("9-10 only", "as fig32, but pair 10-11 may overlap", ignored_pair=LEAD),
    FigureVariant("+e_x", "as fig32, with the sign of e_x in (3.39) as printed", gap_sign=PRINTED),
    FigureVariant("bounded", "as fig32, with readings of 0 m or more, step 6", replace(FIG_3_2, limit_readings=True)),
)


@dataclass(frozen=True)
class FigureRun:
    """One run of a variant, an experiment of the chapter."""

    variant: FigureVariant
    kind: str  # sensors of the lead vehicle that are attacked: "x" or "xv"

    cost: ClassVar[float] = 0.1  # s

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"Fig. 3.2, {self.kind}{LEAD}, {self.variant.name}"

    @property
    def paper(self) -> CollisionRun:
        """What the text says about this attack."""
        (run,) = (run for run in collision_runs() if str(run.sensors) == f"{self.kind}{LEAD}")
        return run

    def run(self) -> CollisionCourse:
        """Run it for up to 60 s."""
        variant = self.variant
        return attack_course(variant.config, self.kind, gap_sign=variant.gap_sign, ignored_pair=variant.ignored_pair)


def figure_runs() -> list[FigureRun]:
    """Every variant with the range sensor attacked, and with both sensors."""
    return [FigureRun(variant, kind) for variant in VARIANTS for kind in ("x", "xv")]


@dataclass(frozen=True)
class FigureRow:
    """One run beside the paper's."""

    run: FigureRun
    course: CollisionCourse

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


def figure_rows(evidence: FdiEvidence) -> list[FigureRow]:
    """All variants."""
    return [FigureRow(run, evidence[run]) for run in figure_runs()]


def main_rows(rows: Sequence[FigureRow]) -> list[FigureRow]:
    """Those of the interpretation fig32 as it stands."""
    return [row for row in rows if row.run.variant == VARIANTS[0]]


def figure_table(evidence: FdiEvidence) -> ExhibitTable:
    """Fig. 3.2 and its variants."""
    title = "Fig. 3.2: Algorithm 2 against the lead of ten vehicles"
    return ExhibitTable(title, COLUMNS, figure_rows(evidence), NOTES, left=2, data=_data)


def _ours(row: FigureRow) -> tuple[str, str, str]:
    hit = row.collision
    return (
        ("none", DASH, DASH)
        if hit is None
        else (f"{hit.time_s:.2f}", f"{hit.impact_speed_mps:.2f}", pair_name(hit.pair))
    )


def _paper(row: FigureRow) -> tuple[str, str, str]:
    return f"{row.paper.time_s:g}", f"{row.paper.impact_speed_mps:g}", pair_name(row.paper.pair)


def _data(row: FigureRow) -> dict[str, Any]:
    return {
        "variant": row.run.variant.name,
        "attacked": str(row.paper.sensors),
        "paper": {name: getattr(row.paper, name) for name in ("pair", "time_s", "impact_speed_mps")},
        "ours": None if row.collision is None else row.collision._asdict(),
        "time_difference": row.time_difference,
        "speed_difference": row.speed_difference,
        "pair_agrees": row.pair_agrees,
        "lowest_reading_m": row.course.lowest_reading_m,
        "infeasible_calls": row.course.infeasible_calls,
        "verdict": row.verdict,
    }


COLUMNS = (
    Column("", "run.variant.name"),
    Column("", "paper.sensors"),
    *across(range(3), ("time", "e_v", "pair").__getitem__, lambda row, k: (_ours(row)[k], _paper(row)[k]), "{}/{}"),
    Column("reading", "course.lowest_reading_m", "{:.1f}"),
    Column("verdict", "verdict"),
)
NOTES = (
    *(f"{variant.name}: {variant.meaning}." for variant in VARIANTS),
    "Ours/paper. time in s, none: no collision in 60 s. e_v in m/s. Pair 10-11 is the lead and its virtual "
    "reference. reading: the lowest of the range sensor in m, physically never below 0.",
    "Verdicts. rough: time and speed within a factor of 2 of the paper's, whichever pair collides. far: otherwise.",
)


TIME = "time / s"
SENSORS = {"x": "range sensor", "xv": "range and range-rate sensors"}
BEHIND = 9  # the pair of the attacked lead with the vehicle behind it, whose collision the paper reports
OURS, BACKGROUND = "tab:red", "tab:blue"


def draw_figure(rows: list[FigureRow]) -> Any:
    """All four panels: a, c for the range sensor, b, d for both sensors."""
    title = "Fig. 3.2 recomputed (k_p 2, k_d 3, dt 0.05 s, Euler); dotted: the paper's collision"
    figure = new_figure(11.0, 7.5, title)
    panels = figure.subplot_mosaic("ab;cd")
    for (upper, lower), row in zip((("a", "c"), ("b", "d")), rows, strict=True):
        course, sensors = row.course, SENSORS[row.run.kind]
        _lines(panels[upper], course, course.gap_m)
        dress(panels[upper], f"{upper}) Separations, {sensors} attacked", TIME, "separation / m")
        panels[upper].axhline(0.0, color="0.3", linewidth=0.8)
        panels[upper].axvline(row.paper.time_s, color="0.4", linewidth=1.0, linestyle=":")
        _lines(panels[lower], course, course.relative_speed_mps)
        dress(panels[lower], f"{lower}) Relative speeds: {_said(row)}", TIME, "relative speed / (m/s)")
        panels[lower].plot(row.paper.time_s, row.paper.impact_speed_mps, "x", color="black", label="paper, about")
        for panel in (panels[upper], panels[lower]):
            panel.set_xlim(0.0, 1.05 * max(row.paper.time_s, course.time_s[-1]))
    add_legend(panels["c"], loc="upper left")
    return figure


def _lines(axes: Any, course: CollisionCourse, values: FloatArray) -> None:
    """One line per pair; the pairs of the attacked lead stand out."""
    others = [None] * (BEHIND - 2) + ["pairs 1-2 to 8-9"]
    colors = shades(len(others), 0.35, 0.9)
    curves(axes, course.time_s, values[:, : BEHIND - 1], others, colors, linewidth=0.7)
    own = [f"pair {pair_name(BEHIND)}", f"pair {pair_name(values.shape[1])} (virtual reference)"]
    curves(axes, course.time_s, values[:, BEHIND - 1 :], own, (BACKGROUND, OURS), linewidth=1.4)


def _said(row: FigureRow) -> str:
    if row.collision is None:
        return "no collision"
    return (
        f"pair {pair_name(row.collision.pair)} at {row.collision.time_s:.2f} s, "
        f"{row.collision.impact_speed_mps:.2f} m/s"
    )
