"""The closing words: what is not reproducible, said plainly; the numbers in them are computed."""

from __future__ import annotations

from collections.abc import Sequence

from cps_paper.chapter import Reproduction
from cps_paper.fdi.audit import SensorComparison, comparisons
from cps_paper.fdi.cells import solved
from cps_paper.fdi.continuous import Continuous, compared, verdict
from cps_paper.fdi.controls import TableControls, control_tables
from cps_paper.fdi.counts import ALLOWANCE, TableCounts, counted
from cps_paper.fdi.experiments import ALL_FOUR, FdiEvidence, FdiSettings
from cps_paper.fdi.figure_3_2 import FigureRow, figure_rows, main_rows
from cps_paper.printed.tables import TABLE_VEHICLES

FIGURE, AUDIT, HORIZONS = "fig", "audit", "horizons"
CONSTANTS = (
    "Not reproducible: the constants. The chapter states neither k_p, k_d, the limits of u, dt, the horizon m nor "
    "d_max. The tables do not identify them: k_p 1 to 2, k_d 2 to 5, u from -8..-4 to 4..5 m/s2 and x_d 4 or 5 m fit "
    "about equally well. With a horizon fitted to each table, six free integers for n = 4, more cells agree (part "
    "horizons): by construction."
)
QUICK = "--quick left out the tables with two attacked vehicles and the fitted horizons."


def closing(found: Reproduction[FdiEvidence]) -> list[str]:
    """Paragraphs on the parts that were computed."""
    evidence, settings = found.evidence, found.evidence.settings
    counts, paragraphs = counted(evidence), []
    if counts:
        controls = control_tables(evidence, list(solved(evidence)))
        paragraphs += [_on_speeds(counts, settings), *_on_five(counts, controls), CONSTANTS, _on_continuous(compared())]
    if AUDIT in found.parts:
        paragraphs.append(_on_contradictions(comparisons()))
    if FIGURE in found.parts:
        paragraphs.append(_on_figure(figure_rows(evidence)))
    if counts:
        paragraphs.append(_on_reference(counts))
    return [*paragraphs, *([QUICK] if evidence.quick else [])]


def _on_speeds(counts: Sequence[TableCounts], settings: FdiSettings) -> str:
    tables = [each for each in counts if TABLE_VEHICLES.get(each.table) == 4]
    both = sum(each.both_feasible for each in tables)
    speed = sum(each.counts.speed for each in tables)
    feasible = sum(each.counts.feasibility for each in tables)
    cells = sum(each.cells for each in tables)
    if not cells:
        return f"Set {settings.parameters}, m = 20."
    unknown, beyond = (
        sum(values) for values in zip(*((each.counts.open, each.beyond) for each in tables), strict=True)
    )
    return (
        f"Not reproducible: the individual speeds. With n = 4 and m = 20 for all tables, {feasible} of {cells} cells "
        f"agree on whether the target can be hit ({unknown} open). Of the {both} hit in both, the best attack of "
        f"{speed} is within 10 % of the printed speed; {beyond} printed speeds are above the certified bound, "
        f"impossible in this game. Set {settings.parameters}."
    )


def _on_five(counts: Sequence[TableCounts], controls: Sequence[TableControls]) -> list[str]:
    ours = {each.table: each for each in counts}
    rule = {each.table: each for each in controls}
    if "3.7" not in ours:
        return []
    feasible, simple = ours["3.7"].counts.feasibility, rule["3.7"].target_attacked
    beats = "fall below" if feasible < simple else "do not fall below"
    text = (
        f"Not reproducible: Table 3.7. Its {feasible} of {ours['3.7'].cells} cells with the right feasibility "
        f'{beats} the {simple} of the rule "feasible iff the target is an attacked vehicle".'
    )
    if ALL_FOUR in ours:
        text += (
            f" For n = 4 the same rule has {rule[ALL_FOUR].target_attacked} of {ours[ALL_FOUR].cells}, ours "
            f"{ours[ALL_FOUR].counts.feasibility}."
        )
    return [text]


def _on_continuous(compared: Sequence[Continuous]) -> str:
    parts = (
        f"{each.constants}: {each.reached} of {each.tasks} tasks reached, against {each.known} with the resolution "
        f"({each.unreachable} proved out of reach, {each.unsettled} open), and on the {len(each.ratios)} with a proved "
        f"optimum {each.mean_ratio:.3f} times as fast on average, at most {max(each.ratios):.3f} times"
        for each in compared
    )
    return (
        "Continuous injections, of which the paper says without numbers that they induce more collisions at higher "
        f"speeds: {verdict(compared)}. The shipped optima have them: {'; '.join(parts)}. That they reach no less holds "
        "for any relaxation; the further tasks and the sizes are the finding."
    )


def _on_contradictions(found: Sequence[SensorComparison]) -> str:
    count = sum(each.contradiction for each in found)
    return (
        f"The printed tables contradict one another in {count} of {len(found)} comparisons, so no single set of "
        "constants with exact optima explains all cells: horizon, grid or solver limit must have differed between them."
    )


def _on_figure(rows: Sequence[FigureRow]) -> str:
    parts = [
        f"{row.paper.sensors} after {row.collision.time_s:.2f} s at {row.collision.impact_speed_mps:.2f} m/s (paper "
        f"{row.paper.time_s:g} s, {row.paper.impact_speed_mps:g} m/s)"
        for row in main_rows(rows)
        if row.collision is not None
    ]
    lowest = min(row.course.lowest_reading_m or 0.0 for row in main_rows(rows))
    return (
        f"Fig. 3.2: order of magnitude reproduced, not confirmed: {'; '.join(parts)}. The parameters were selected "
        "among several hundred, the impact speed depends on the phase of a growing oscillation (-0.3 to -6 m/s for "
        f"small changes), and readings fall to {lowest:.1f} m, which no range sensor shows. Not reproducible: the "
        "collision of vehicles 9 and 10. The first to collide are the lead and its virtual reference."
    )


def _on_reference(counts: Sequence[TableCounts]) -> str:
    stated = [each for each in counts if each.reference is not None]
    if not stated:
        return "The reference has other settings; the counts are not judged."
    failed = [each.table for each in stated if not each.passed]
    held = len(stated) - len(failed)
    text = f"Regression: in {held} of {len(stated)} rows every count is within {ALLOWANCE} of its reference."
    if failed:
        text += f" FAILED: {', '.join(failed)}. Another version of HiGHS, or a mistake: no search ends by time."
    return text
