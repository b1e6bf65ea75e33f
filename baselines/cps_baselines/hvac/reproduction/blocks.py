"""The reproduction as tables of text, ready for a terminal or a page."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.reproduction.cells import CELL_RULES, Row, table_rows
from cps_baselines.hvac.reproduction.claims_4_4 import mean_rise_c
from cps_baselines.hvac.reproduction.claims_4_5 import LARGEST
from cps_baselines.hvac.reproduction.clear_day import NOON_H, START_H, energy_days, zone_days
from cps_baselines.hvac.reproduction.estimation_errors import largest_errors_c
from cps_baselines.hvac.reproduction.evaluation import evaluate
from cps_baselines.hvac.reproduction.experiments import (
    ATTACKS,
    DAYS,
    DEFENCES,
    EARLY,
    EARLY_COUNTS,
    FIGURE_4_5_DAYS,
    FIGURE_4_6_DAYS,
    OBSERVERS,
    TABLE_DAYS,
    Case,
    early,
    observed,
    undefended,
)
from cps_baselines.hvac.reproduction.impacts import failing_line, outcomes
from cps_baselines.hvac.reproduction.scenario import Outcome
from cps_baselines.hvac.reproduction.sets import set_courses
from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.evidence import Evidence

DASH = "-"


def table_block(evidence: Evidence, table: str) -> Block:
    """Table 4.1 or 4.2, a row per condition and source."""
    noise = table == "4.1"
    columns = ("noise" if noise else "A", "from", *(f"zone {zone}" for zone in range(1, 5)), "mean", "verdict")
    rows = table_rows(evidence, table)
    shown = [
        (
            f"{row.percent} %" if noise else f"±{row.percent} %",
            _source(row),
            *(f"{cell.paper.mean_abs_error_c:.2f}/{cell.ours:.2f}" for cell in row.cells),
            f"{row.paper:.2f}/{row.ours:.2f}" + ("" if noise else " ({:.1f}-{:.1f})".format(*row.spread)),
            row.verdict,
        )
        for row in rows
    ]
    average = "mean" if noise else "median, in brackets the quartiles,"
    notes = (
        f"Mean absolute tracking error in °C, paper/ours: {average} over {TABLE_DAYS[table]} "
        + ("days." if noise else "buildings whose A_c is off by up to so much, without noise."),
        f"Verdict of the zone mean. {CELL_RULES}",
    )
    breaks = [i for i in range(len(rows) - 1) if rows[i].percent != rows[i + 1].percent]
    return Block(f"Table {table}", columns, shown, 2, notes, breaks)


def clear_day_block(evidence: Evidence) -> Block:
    """Fig. 4.2 in numbers."""
    columns = ("zone", "before noon", "after 13 h", "heating", "none after", "below 25 °C")
    rows = [
        (
            str(day.zone),
            f"{day.morning_error_c:.2f} °C",
            f"{day.afternoon_error_c:.2f} °C",
            f"{day.morning_heating_w:.1f} W",
            f"{max(day.heated_hours, default=-1) + 1} h",
            f"{100.0 * day.below_share:.0f} %",
        )
        for day in zone_days(evidence)
    ]
    note = (
        f"Largest tracking errors from {START_H:g} h to noon and after 13 h; mean heating from {START_H:g} to "
        f"{NOON_H:g} h and when it ended; heated steps of the day in which the zone was measured below 25 °C."
    )
    return Block("Fig. 4.2: attack-free day, without noise", columns, rows, 1, (note,))


def energies_block(evidence: Evidence) -> Block:
    """Fig. 4.3 in numbers."""
    columns = ("E", "usual level (paper)", "on-time", "largest error (paper)")
    claims = evaluate(evidence, ("C06", "C07", "C08", "C10"))
    levels, worst = [claim.number for claim, _ in claims[:3]], claims[3][0].number
    rows = [
        (
            f"{day.energy_w:g} W",
            f"{day.usual_level_percent:g} % ({paper:g} %)",
            f"{100.0 * day.on_share:.0f} %",
            f"{day.largest_error_c:.2f} °C (below {worst:g})",
        )
        for day, paper in zip(energy_days(evidence), levels, strict=True)
    ]
    return Block("Fig. 4.3: zone 1 with three input energies", columns, rows, 1)


def undefended_blocks(evidence: Evidence) -> list[Block]:
    """Fig. 4.4 in numbers."""
    rows = [(attacker, *(_impact(evidence[undefended(attacker, count)]) for count in range(5))) for attacker in ATTACKS]
    columns = ("attack", "none", *(", ".join(map(str, range(1, count + 1))) for count in range(1, 5)))
    note = f"Mean ± standard deviation over {DAYS[4]} days, °C². Paper: {_paper(evidence, 'C12')} for constant, 1."
    rise = [f"{each:+.1f} °C" for each in mean_rise_c(evidence)]
    return [
        Block("Fig. 4.4a: A_impact without a defence, by attacked sensors", columns, rows, 1, (note,)),
        Block(
            "Fig. 4.4b: mean rise while sensor 1 reads 22 °C",
            ("", *(f"zone {zone}" for zone in range(1, 5))),
            [("over the same days without an attack", *rise)],
        ),
    ]


def observers_block(evidence: Evidence) -> Block:
    """Fig. 4.5 in numbers."""
    papers = {place: _paper(evidence, name) for name, place in LARGEST.items()}
    rows = [
        (
            ", ".join(f"s{sensor}" for sensor in sensors),
            str(window),
            f"{evidence[observed(sensors, window)].time_h[window]:.2f} h",
            *(_errors(evidence, (sensors, window), zone, papers) for zone in range(1, 5)),
        )
        for sensors, window in OBSERVERS
    ]
    columns = ("sensors", "N_e", "starts", *(f"zone {zone}" for zone in range(1, 5)))
    note = f"Largest estimation error in °C: median (range) over {FIGURE_4_5_DAYS} days; paper: where it gives one."
    return Block("Fig. 4.5: the observer with few sensors", columns, rows, 1, (note,))


def sets_block(evidence: Evidence) -> Block:
    """Fig. 4.6 in numbers."""
    rows = [
        (
            str(each.index),
            ", ".join(f"s{sensor}" for sensor in each.sensors),
            "intact" if each.intact else "flawed",
            f"{each.residual_c2:.3f}",
            f"{each.late_residual_c2:.3f}",
            f"{100.0 * each.selected_share:.1f} %",
        )
        for each in set_courses(evidence)
    ]
    note = (
        f"Medians over {FIGURE_4_6_DAYS} days from the onset on, °C²; late: once the window holds forged readings only."
    )
    columns = ("set", "sensors", "", "J", "J, late", "selected by MTD1")
    return Block("Fig. 4.6: sensor 2 reads 22 °C", columns, rows, 3, (note,))


def bars_blocks(evidence: Evidence, num_sensors: int) -> list[Block]:
    """Figs. 4.7 and 4.8 in numbers."""
    number = {4: 7, 8: 8}[num_sensors]
    columns = ("attack", "defence", "free", *map(str, range(1, num_sensors + 1)))
    rows = [
        (attacker, defender, *(_impact(bar) for bar in outcomes(evidence, num_sensors, attacker, defender)))
        for attacker in ATTACKS
        for defender in DEFENCES
    ]
    sets = [
        (
            defender,
            kind,
            *(f"{getattr(bar, field).mean():.1f}" for bar in outcomes(evidence, num_sensors, "random", defender)),
        )
        for defender in DEFENCES[1:]
        for kind, field in (("all", "distinct_sets"), ("intact", "intact_sets"))
    ]
    line = failing_line(evidence, num_sensors)
    notes = (
        f"Mean ± standard deviation over {DAYS[num_sensors]} days, °C², by number of attacked sensors. A defence has "
        f"failed above {line:.1f} °C², the impact of attack-free days without any.",
    )
    return [
        Block(f"Fig. 4.{number}a-c: A_impact with {num_sensors} sensors", columns, rows, 2, notes, (2, 5)),
        Block(f"Fig. 4.{number}d: sensor sets selected, random attack", ("defence", "sets", *columns[2:]), sets, 2),
    ]


def early_block(evidence: Evidence) -> Block:
    """MTD2 against attacks that start before the window is full."""
    rows = [
        (
            str(onset),
            attacker,
            *(_with_median(evidence[early(onset, attacker, count)]) for count in EARLY_COUNTS),
        )
        for onset, attacker in EARLY
    ]
    note = (
        f"Mean (median) A_impact over {DAYS[4]} days, °C². The paper does not say when attacks start; from step 200 on "
        "they leave MTD2 at 1.2. Single days weigh heavily: then {s2} alone looks perfect and is chosen."
    )
    columns = ("onset step", "attack", *(f"{count} of 4" for count in EARLY_COUNTS))
    return Block("Not in the paper: MTD2 under attacks that come before it is ready", columns, rows, 2, (note,))


def _source(row: Row) -> str:
    return f"{row.sensors_used} sensor{'s' * (row.sensors_used > 1)}" if row.sensors_used else "readings"


def _impact(outcome: Outcome) -> str:
    days = outcome.a_impact
    digits = 1 if days.mean() < 100.0 else 0
    return f"{days.mean():.{digits}f} ± {days.std(ddof=1):.{digits}f}"


def _with_median(outcome: Outcome) -> str:
    return f"{outcome.a_impact.mean():.1f} ({np.median(outcome.a_impact):.1f})"


def _errors(evidence: Evidence, case: Case, zone: int, papers: dict[tuple[Case, int], str]) -> str:
    days = largest_errors_c(evidence, case)[:, zone - 1]
    paper = f"\npaper {papers[case, zone].split()[0]}" if (case, zone) in papers else ""
    return f"{np.median(days):.2f} ({days.min():.2f}-{days.max():.2f}){paper}"


def _paper(evidence: Evidence, claim_id: str) -> str:
    ((claim, _),) = evaluate(evidence, (claim_id,))
    return claim.paper_shown
