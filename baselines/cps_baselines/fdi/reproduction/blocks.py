"""The reproduction as tables of text, ready for a terminal or a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from cps_baselines.fdi.highs import TIME_LIMIT
from cps_baselines.fdi.reproduction.audit import Comparison, worst
from cps_baselines.fdi.reproduction.cells import RULES, Cell
from cps_baselines.fdi.reproduction.continuous import Continuous
from cps_baselines.fdi.reproduction.controls import FASTEST_MPS, TableControls
from cps_baselines.fdi.reproduction.counts import ALLOWANCE, TableCounts
from cps_baselines.fdi.reproduction.experiments import ONE_HORIZON_LIMIT_S
from cps_baselines.fdi.reproduction.figure import FigureRow
from cps_baselines.fdi.reproduction.settings import Settings
from cps_baselines.fdi.reproduction.variants import VARIANTS
from cps_baselines.paper.collisions import CollisionCell
from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.verdicts import SAME_SHARE

EXAMPLES = 8
DASH = "-"
CELL_NOTES = (
    "e_v in m/s by pair, closing < 0. distance: of the end from the grid point that was accepted, else the smallest "
    "that was found. solver: no solve (the linear relaxation settles it), proved, or how many solves ended by time.",
    RULES,
)


def cell_blocks(cells: Mapping[str, Sequence[Cell]], settings: Settings) -> list[Block]:
    """Every table cell by cell; how to read them stands under the last."""
    made = [_cell_block(table, members, settings) for table, members in cells.items()]
    return [*made[:-1], *(replace(block, notes=CELL_NOTES) for block in made[-1:])]


def _cell_block(table: str, cells: Sequence[Cell], settings: Settings) -> Block:
    columns = ("", "target", "paper, e_v", "ours, e_v", "distance", "solver", "verdict")
    rows = [
        (
            str(cell.paper.task.sensors),
            f"V_{cell.paper.task.target}",
            _pairs(cell.paper.speeds_mps),
            _pairs(cell.ours.pairs),
            DASH if cell.ours.distance is None else f"{cell.ours.distance:.3f}",
            solver_shown(cell),
            cell.verdict,
        )
        for cell in cells
    ]
    config = settings.config(table)
    title = (
        f"Table {table}: n = {config.num_vehicles}, set {settings.parameters}, m = {config.horizon}, "
        f"{settings.back_end}, {settings.time_limit_s:g} s per solve"
    )
    breaks = [row for row in range(len(cells) - 1) if rows[row][0] != rows[row + 1][0]]
    return Block(title, columns, rows, left=4, breaks=breaks)


def counts_block(counts: Sequence[TableCounts], settings: Settings) -> Block:
    """The four counts of every table, with their goals."""
    columns = ("Table", "cells", "feasibility", "both", "pairs", "pairs incl.", "speed 10 %")
    rows = []
    for each in counts:
        shown = [
            f"{count}" if goal is None else f"{count} ({goal})"
            for count, goal in zip(each.counts, each.goals or [None] * len(each.counts), strict=True)
        ]
        rows.append((each.table, str(each.cells), shown[0], str(each.both_feasible), *shown[1:]))
    goals = f"In brackets the goals; a count more than {ALLOWANCE} below its goal fails the command."
    if not settings.has_goals:
        goals = "Goals were stated for highs, at least 2 s per solve and acceptance 0.45 only."
    notes = (
        "Cells that agree. feasibility: the target is hit in both or in neither. both: hit in both; of these, pairs: "
        "the same pairs collide, pairs incl.: all printed ones do, speed: the target's within 10 %.",
        goals,
    )
    return Block(f"Agreement with the printed tables, set {settings.parameters}", columns, rows, 1, notes)


def controls_block(controls: Sequence[TableControls], counts: Sequence[TableCounts]) -> Block:
    """Feasibility by rules that know less, beside ours."""
    columns = ("Table", "cells", "ours", "target attacked", "C, LP", "m = 20", f"m = 20, {FASTEST_MPS:g} m/s")
    ours = {each.table: str(each.counts.feasibility) for each in counts}
    rows = [
        (
            each.table,
            str(each.cells),
            ours.get(each.table, DASH),
            str(each.target_attacked),
            *(
                DASH if count is None else str(count)
                for count in (each.relaxed, each.one_horizon, each.one_horizon_fast)
            ),
        )
        for each in controls
    ]
    notes = (
        "Cells whose feasibility agrees with the paper. target attacked: feasible iff the target is an attacked "
        f"vehicle. C, LP: set C, m = 25, feasible iff the relaxation reaches {FASTEST_MPS:g} m/s. m = 20: set A with "
        f"one horizon for all tables, integers, feasible iff a collision is found in {ONE_HORIZON_LIMIT_S:g} s, in the "
        f"last column one at {FASTEST_MPS:g} m/s or more; both depend on the machine.",
    )
    return Block("Control rules", columns, rows, 1, notes)


def continuous_block(found: Sequence[Continuous]) -> Block:
    """Continuous injections against those that obey the resolution."""
    columns = ("Preset", "tasks", "continuous", "known", "unreachable", "open", "proved", "faster", "mean", "largest")
    rows = [
        (
            each.preset,
            *map(str, (each.tasks, each.reached, each.known, each.unreachable, each.unsettled, len(each.ratios))),
            str(each.notably_faster),
            f"{each.mean_ratio:.3f}",
            f"{max(each.ratios):.3f}",
        )
        for each in found
    ]
    notes = (
        "Tasks that continuous injections reach; of these: reached by a known plan that obeys the resolution, proved "
        "out of its reach, open. Of those with a proved optimum: how many continuous injections hit more than "
        f"{100 * SAME_SHARE:g} % faster, and their highest impact speed over the optimum. Optima of `cps-envs oracle`, "
        "with one horizon for all tasks.",
    )
    return Block("Continuous injections against the resolution", columns, rows, 1, notes)


def audit_block(found: list[Comparison]) -> Block:
    """The contradictions of the printed tables, in numbers and by the largest."""
    rows = [
        (f"V_{each.fewer.task.target}", *_stated(each.fewer), *_stated(each.more), f"{each.drop_mps:.3f}")
        for each in worst(found, EXAMPLES)
    ]
    count = sum(each.contradiction for each in found)
    title = f"Audit of Tables 3.1 to 3.6: {count} of {len(found)} comparisons contradict one another; the largest"
    columns = ("target", "fewer sensors", "Table", "e_v", "more sensors", "Table", "e_v", "lost")
    notes = (
        "With more attacked sensors the attacker can inject nothing into the additional ones, so the best impact speed "
        'cannot fall. A contradiction: "-", or more than 10 % slower. Speeds in m/s.',
    )
    return Block(title, columns, rows, 2, notes)


def beyond_block(beyond: Sequence[tuple[CollisionCell, float | None]], printed: int) -> Block:
    """Printed speeds that set A cannot reach even without the resolution."""
    rows = [
        (
            cell.table,
            str(cell.task.sensors),
            f"V_{cell.task.target}",
            f"{-(cell.target_speed_mps or 0.0):.3f}",
            "none" if fastest is None else f"{fastest:.3f}",
        )
        for cell, fastest in sorted(beyond, key=lambda each: (each[1] or 0.0) + (each[0].target_speed_mps or 0.0))
    ]
    title = f"{len(beyond)} of {printed} printed speeds lie beyond the relaxation of set A at m = 20; the largest"
    columns = ("Table", "", "target", "paper, m/s", "at most, m/s")
    return Block(
        title, columns, rows[:EXAMPLES], 3, ("At most: linear program without the resolution; none: no collision.",)
    )


def figure_block(rows: Sequence[FigureRow]) -> Block:
    """Fig. 3.2 and its variants."""
    columns = ("", "", "time", "e_v", "pair", "reading", "verdict")
    shown = []
    for row in rows:
        hit, paper = row.collision, row.paper
        ours = ("none", DASH, DASH)
        if hit is not None:
            ours = (f"{hit.time_s:.2f}", f"{hit.impact_speed_mps:.2f}", pair_name(hit.pair))
        theirs = (f"{paper.time_s:g}", f"{paper.impact_speed_mps:g}", pair_name(paper.pair))
        both = (f"{mine}/{printed}" for mine, printed in zip(ours, theirs, strict=True))
        shown.append(
            (row.run.variant.name, str(paper.sensors), *both, f"{row.course.lowest_reading_m:.1f}", row.verdict)
        )
    notes = (
        *(f"{variant.name}: {variant.meaning}." for variant in VARIANTS),
        "Ours/paper. time in s, none: no collision in 60 s. e_v in m/s. Pair 10-11 is the lead and its virtual "
        "reference. reading: the lowest of the range sensor in m, physically never below 0.",
        "Verdicts. rough: time and speed within a factor of 2 of the paper's, whichever pair collides. far: otherwise.",
    )
    return Block("Fig. 3.2: Algorithm 2 against the lead of ten vehicles", columns, shown, 2, notes)


def solver_shown(cell: Cell) -> str:
    """How the solver settled a cell."""
    statuses = cell.ours.statuses
    if not statuses:
        return "no solve"
    limited = statuses.count(TIME_LIMIT)
    return f"{limited}/{len(statuses)} by time" if limited else "proved"


def pair_name(pair: int) -> str:
    """Pair i with the vehicle ahead of it."""
    return f"{pair}-{pair + 1}"


def _pairs(speeds_mps: Sequence[tuple[int, float]]) -> str:
    return "\n".join(f"{pair_name(pair)} {speed:.3f}" for pair, speed in speeds_mps) or DASH


def _stated(cell: CollisionCell) -> tuple[str, str, str]:
    speed = cell.target_speed_mps
    return str(cell.task.sensors), cell.table, DASH if speed is None else f"{speed:.3f}"
