"""The reproduction as tables of text, ready for a terminal or a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby

from cps_baselines.disbanding.reproduction.cells import AVERAGED, Cell, Effect, mean_distance, table_cells
from cps_baselines.disbanding.reproduction.evaluation import evaluate
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.experiments import FIGURE_TAUS_S, PLATOONS
from cps_baselines.disbanding.reproduction.optimal import Events, optima
from cps_baselines.disbanding.reproduction.strings import EveryOther, PlatoonCourse, StringCourse, courses
from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.recovery import RECOVERY_RULE
from cps_baselines.reproduction.verdicts import NEAR, NOT, REPRODUCED
from cps_envs.disbanding.config import INTERPRETATIONS

DASH = "-"
CELL_NOTE = (
    "Crash: the paper's flag / ours, * where they differ. mpc: one set of weights for all cells, tuned on the mpc "
    "column of Table 2.2. Effect: of the mitigation on E_v in points, against the baseline of the same setting, ours / "
    "paper; reproduced within 5 %, near within 10 %. Last column: E_v averaged over {other}, see the means below."
)


def cell_blocks(evidence: Evidence, table: str) -> list[Block]:
    """A table of velocity errors cell by cell, and its means."""
    cells, averaged = table_cells(evidence, table), AVERAGED[table]
    other = "all" if averaged == "intact" else "intact"
    columns = ("", "x_d", "tau", "paper", "ours", "diff.", "verdict", "effect", "its verdict", "crash", other)
    rows = [
        (
            cell.paper.controller,
            f"{cell.paper.desired_gap_m:g} m",
            f"{cell.paper.tau_s:g} s",
            f"{cell.paper.velocity_error_percent:.2f}",
            f"{cell.ours:.2f}",
            f"{cell.difference:+.2f}",
            cell.verdict,
            *_effect(cell.effect),
            f"{_yes(cell.paper.crash)}/{_yes(cell.outcome.crash)}" + ("" if cell.crash_agrees else "*"),
            f"{cell.averages[other]:.2f}",
        )
        for cell in cells
    ]
    title = f"Table {table}: E_v in percent over {_set(averaged)}, {evidence.experiments.interpretation}"
    return [Block(title, columns, rows, 3, (CELL_NOTE.format(other=_set(other)),), (5, 11)), _means(table, cells)]


def _means(table: str, cells: Sequence[Cell]) -> Block:
    rows = []
    for controller, group in groupby(cells, key=lambda cell: cell.paper.controller):
        row = list(group)
        counts = [sum(cell.verdict == word for cell in row) for word in ("match", "near", "miss")]
        means = [f"{mean_distance(row, averaged):.2f}" for averaged in ("intact", "all")]
        effects = [cell.effect.verdict for cell in row if cell.effect is not None]
        shown = " / ".join(str(effects.count(word)) for word in (REPRODUCED, NEAR, NOT)) if effects else DASH
        flags = f"{sum(cell.crash_agrees for cell in row)} of {len(row)}"
        rows.append((controller, *means, " / ".join(map(str, counts)), shown, flags))
    columns = ("", "over intact", "over all", "match / near / miss", "effect: same / near / not", "same crash flag")
    title = f"Table {table}: mean absolute difference from the paper in points"
    return Block(title, columns, rows)


def _effect(effect: Effect | None) -> tuple[str, str]:
    return (DASH, "") if effect is None else (f"{effect.ours:+.1f} / {effect.paper:+.1f}", effect.verdict)


def figure_2_1_blocks(evidence: Evidence) -> list[Block]:
    """What Fig. 2.1 shows, in numbers."""
    platoons, strings, others = courses(evidence)
    return [_platoons(platoons), _strings(strings), _every_other(others)]


def _platoons(rows: Sequence[PlatoonCourse]) -> Block:
    columns = ("Platoon", "smallest gap", "largest gap", "gaps settled", "all stopped", "slowest", "leader's top speed")
    shown = [
        (
            str(row.platoon),
            f"{row.smallest_gap_m:.2f} m",
            f"{row.largest_gap_m:.1f} m",
            "-" if row.settled_s is None else f"{row.settled_s:.0f} s",
            f"{row.stopped_s:.0f} s",
            f"{row.slowest_mps:.1f} m/s",
            f"{row.top_speed_mps:.1f} m/s",
        )
        for row in rows
    ]
    return Block("Figs. 2.1a-c: 20 platoons, the lead one (20) disbanded at 2 s; gaps inside a platoon", columns, shown)


def _strings(rows: Sequence[StringCourse]) -> Block:
    columns = ("Platoons", "rear vehicle stands", "recovered", "paper")
    shown = [
        (
            str(row.num_platoons),
            f"{row.rear_stopped_s:.0f} s",
            f"never in {row.duration_min:.0f} min" if row.recovered_min is None else f"{row.recovered_min:.1f} min",
            f"{row.paper_min:g} min",
        )
        for row in rows
    ]
    note = (
        f"{RECOVERY_RULE} The linear gain from rear vehicle to rear vehicle exceeds one (`cps-envs string-stability`): "
        "disturbances grow from platoon to platoon, so that a long string need not settle."
    )
    return Block("Fig. 2.1d: the rear vehicle behind strings of platoons", columns, shown, notes=(note,))


def _every_other(rows: Sequence[EveryOther]) -> Block:
    columns = ("tau", "stop once", "twice", "three times", "collided", "as rear vehicle")
    shown = [
        (f"{row.tau_s:g} s", *(f"{share:.0f} %" for share in (*row.stops, row.collided, row.rear_collided)))
        for row in rows
    ]
    shown.append(("paper", "65 %", "45 %", "37.5 %", "55 %", ""))
    title = "Fig. 2.1e: every other of 20 platoons disbanded, 30 s apart"
    note = (
        "Shares of the 100 vehicles never disbanded, which stop at least so often. The paper speaks of platoons; "
        "37.5 % is no whole number of 10 platoons or 100 vehicles, so that its count must be another one."
    )
    return Block(title, columns, shown, notes=(note,), breaks=(len(shown) - 2,))


def figure_2_3_blocks(evidence: Evidence) -> list[Block]:
    """What Fig. 2.3 shows, in numbers."""
    findings = evaluate(evidence, ("P21", "P22"))
    rows = [(f"Fig. {claim.figure}", claim.paper, finding.shown, finding.verdict) for claim, finding in findings]
    speeds = Block("Figs. 2.3a, b: E_v in percent", ("", "paper", "ours", "verdict"), rows)
    experiments = evidence.experiments

    def sweep(title: str, value: Callable[[int, float], str]) -> Block:
        shown = [(f"{tau_s:g} s", *(value(count, tau_s) for count in PLATOONS)) for tau_s in FIGURE_TAUS_S]
        return Block(title, ("tau \\ N", *map(str, PLATOONS)), shown)

    return [
        speeds,
        sweep(
            "Fig. 2.3c: E_v in percent over intact vehicles, lead platoon disbanded at 1 s",
            lambda count, tau_s: f"{evidence[experiments.single(count, tau_s)].velocity_error_intact:.2f}",
        ),
        sweep(
            "Fig. 2.3d: vehicles involved in collisions",
            lambda count, tau_s: str(int(evidence[experiments.single(count, tau_s)].collided.sum())),
        ),
    ]


def search_blocks(evidence: Evidence) -> list[Block]:
    """What the genetic algorithm finds."""
    found = optima(evidence)
    rows = []
    for row in found:
        star = {source: "*" if source == row.best[0] else " " for source in ("GA", "paper", "grid")}
        grid = "" if row.grid_error is None else f"{_plan(row.grid[1:])} {row.grid_error:.2f}{star['grid']}"
        errors = (f"{row.found.value:.2f}{star['GA']}", f"{row.paper_error:.2f}{star['paper']}")
        rows.append((f"{row.tau_s:g} s", _plan(row.events), *errors, grid, row.verdict))
    columns = ("tau", "GA finds", "E_v ", "paper ", "grid ", "verdict")
    title = "Genetic algorithm for (2.9): E_v in percent over all vehicles"
    note = (
        "Attacks as (platoon, second); N = 10, x_d = 5 m, no defence, seed 0; * the largest. Paper: its plans under "
        "our model, (10,1) for one platoon, (10,2) (9,100) for two. Grid: the lead platoon at 2 s and any other at 20, "
        "40, ... 180 s. The verdict is whether the search finds the paper's plan; with two platoons a search of this "
        "size may miss the best one."
    )
    singles = sum(row.budget == 1 for row in found)
    return [Block(title, columns, rows, 2, (note,), (singles - 1,) if 0 < singles < len(rows) else ())]


def interpretation_blocks(evidence: Evidence) -> list[Block]:
    """The baseline of both tables, and the claims about its collisions, under every interpretation."""
    rows = []
    for table, claim in (("2.2", "P29"), ("2.3", "P39")):
        for name in INTERPRETATIONS:
            there = evidence.under(name)
            cells = table_cells(there, table, ("baseline",))
            values = [f"{cell.ours:.2f}" for cell in cells]
            flags = "".join("Y" if cell.outcome.crash else "N" for cell in cells)
            verdict = evaluate(there, (claim,))[0][1].verdict
            rows.append((table, name, *values, flags, f"{mean_distance(cells):.2f}", f"{claim} {verdict}"))
    names = [f"{cell.paper.desired_gap_m:g}, {cell.paper.tau_s:g}" for cell in cells]
    columns = ("Table", "", *names, "crash", "mean diff.", "claim")
    title = "Baseline under every interpretation: E_v in percent at (x_d in m, tau in s)"
    return [Block(title, columns, rows, 2, breaks=(2,))]


def _plan(events: Events) -> str:
    return " ".join(f"({platoon},{time_s:g})" for platoon, time_s in events)


def _set(averaged: str) -> str:
    return {"intact": "vehicles never disbanded", "all": "all vehicles"}[averaged]


def _yes(value: bool) -> str:
    return "yes" if value else "no"
