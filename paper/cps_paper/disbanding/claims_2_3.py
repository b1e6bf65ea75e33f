"""The claims about Fig. 2.3 and the optimal attacks, P21 to P28, P37 and P38, and those of section 2.4.3.

Those are about the tables: P29 to P36 and P39 to P44.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cps_baselines.disbanding.heuristic_policy import FORESIGHT
from cps_baselines.disbanding.mpc import PAPER_MATCHING
from cps_paper.claims import Claim, Finding, applying, joined
from cps_paper.disbanding.cells import VelocityErrorPair, table_cells
from cps_paper.disbanding.effort import heuristic_products, mpc_products
from cps_paper.disbanding.experiments import (
    ATTACK_S,
    ATTACKS,
    CELLS,
    FIGURE_TAUS_S,
    LATER_S,
    PLATOONS,
    SECOND_PLANS,
    TAUS_S,
    DisbandingEvidence,
)
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import CONTROLLERS, ScenarioOutcome
from cps_paper.printed.tables import POINTS
from cps_paper.verdicts import by_construction, grows_throughout, of_cases, of_number


@CLAIMS.judges("P21", "P22")
def mean_error(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """E_v of Figs. 2.3a and b, averaged over the intact vehicles."""
    attack = ((10, ATTACK_S),) if claim.id == "P21" else ATTACKS["2.3"]
    outcome = evidence[evidence.rear_speeds(attack)]
    value = outcome.velocity_error_intact
    shown = f"{value:.2f} % over intact vehicles ({outcome.velocity_error_all:.2f} % over all)"
    return Finding(value, shown, by_construction(of_number(value, claim.number, POINTS)))  # the set was chosen for it


@CLAIMS.judges("P23")
def lead_is_best(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Disbanding any other platoon at the first instant is worse, for every N and tau."""
    hold = []
    for tau_s in FIGURE_TAUS_S:
        for count in PLATOONS:
            errors = [_error(evidence, count, tau_s, platoon) for platoon in range(1, count + 1)]
            hold.append(max(errors) == errors[-1])
    return Finding.of_cases(hold, f"in {sum(hold)} of {len(hold)} cases of N and tau")


@CLAIMS.judges("P24")
def first_instant_is_best(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The best second for the lead platoon, over N and tau."""
    times, best = (1.0, *LATER_S), []
    for tau_s in FIGURE_TAUS_S:
        for count in PLATOONS:
            errors = [_error(evidence, count, tau_s, time_s=time_s) for time_s in times]
            best.append(times[errors.index(max(errors))])
    hold = [time_s == claim.number for time_s in best]
    flat = [_error(evidence, PLATOONS[-1], TAUS_S[0], time_s=time_s) for time_s in (times[0], times[3])]
    shown = f"1 s in {sum(hold)} of {len(hold)} cases; flat: {flat[0]:.2f} % at 1 s, {flat[1]:.2f} % at {times[3]:g} s"
    return Finding(max(set(best), key=best.count), shown, of_cases(hold))


@CLAIMS.judges("P25")
def grows(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """E_v over the number of platoons, for every tau."""
    curves = {tau_s: [_error(evidence, count, tau_s) for count in PLATOONS] for tau_s in FIGURE_TAUS_S}
    hold = [grows_throughout(curve) for curve in curves.values()]
    ends = ", ".join(f"{curves[tau_s][0]:.1f} to {curves[tau_s][-1]:.1f}" for tau_s in TAUS_S)
    return Finding.of_cases(hold, f"for every tau; N = 2 to 10: {ends} % at tau {joined(list(TAUS_S), 'g')} s")


@CLAIMS.judges("P26")
def crash_threshold(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The largest tau without any collision; below and above it, whatever N, none and some."""
    hold, safe = [], []
    for tau_s in FIGURE_TAUS_S:
        crashes = [_collided(evidence, count, tau_s) > 0 for count in PLATOONS]
        hold += [crash == (tau_s > claim.number) for crash in crashes]
        safe += [] if any(crashes) else [tau_s]
    threshold = max(safe, default=None)
    return Finding(threshold, f"as claimed in {sum(hold)} of {len(hold)} cases of N and tau", of_cases(hold))


@CLAIMS.judges("P27")
def more_collisions(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Vehicles involved in collisions over N, for every tau that has collisions."""
    curves = {tau_s: [_collided(evidence, count, tau_s) for count in PLATOONS] for tau_s in FIGURE_TAUS_S}
    applies = applying(sum(map(any, curves.values())), len(curves), "tau")
    curves = {tau_s: curve for tau_s, curve in curves.items() if any(curve)}
    hold = [grows_throughout(curve) for curve in curves.values()]
    ends = ", ".join(f"{curve[0]} to {curve[-1]} (tau {tau_s:g} s)" for tau_s, curve in curves.items())
    return Finding.of_cases(hold or [False], f"vehicles for N = 2 to 10: {ends}; {applies}")


@CLAIMS.judges("P28")
def rear_vehicles_stop(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The rear vehicles of the nine intact platoons: all slow down, some stop."""
    record = evidence[evidence.rear_speeds(((10, ATTACK_S),))]
    size = record.config.vehicles_per_platoon
    rear = slice(2 * size - 1, None, size)
    slower = (record.speed_mps[:, rear].min(axis=0) < record.config.desired_speed_mps - 1.0).tolist()
    stopped = record.stops[rear] > 0
    shown = f"{sum(slower)} of {len(slower)} slow down, {stopped.sum()} stop"
    return Finding(all(slower) and bool(stopped.any()), shown, of_cases([*slower, bool(stopped.any())]))


@CLAIMS.judges("P37", "P38")
def second_attack(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The best second platoon and second on a grid, with the lead platoon disbanded at 2 s."""
    best = [best_second(evidence, tau_s) for tau_s in TAUS_S]
    which = 0 if claim.id == "P37" else 1
    hold = [of_number(plan[which], claim.number) == "reproduced" for plan in best]
    paper = [second_error(evidence, tau_s, *ATTACKS["2.3"][1]) for tau_s in TAUS_S]
    gains = [
        second_error(evidence, tau_s, *plan) - value for tau_s, plan, value in zip(TAUS_S, best, paper, strict=True)
    ]
    shown = "; ".join(
        f"tau {tau_s:g} s: ({platoon}, {time_s:g} s)" + (f", {gain:.1f} points above the paper's" if gain else "")
        for tau_s, (platoon, time_s), gain in zip(TAUS_S, best, gains, strict=True)
    )
    return Finding(best[0][which], shown, of_cases(hold))


def best_second(evidence: DisbandingEvidence, tau_s: float) -> tuple[int, float]:
    """The platoon and second, with the lead platoon disbanded at 2 s, with the largest E_v over all vehicles."""
    return max(SECOND_PLANS, key=lambda plan: second_error(evidence, tau_s, *plan))


def second_error(evidence: DisbandingEvidence, tau_s: float, platoon: int, time_s: float) -> float:
    """E_v in percent over all vehicles of a two-platoon attack."""
    return evidence[evidence.second(tau_s, platoon, time_s)].velocity_error_all


def _error(
    evidence: DisbandingEvidence, count: int, tau_s: float, platoon: int | None = None, time_s: float = 1.0
) -> float:
    return evidence[evidence.single(count, tau_s, platoon, time_s)].velocity_error_intact


def _collided(evidence: DisbandingEvidence, count: int, tau_s: float) -> int:
    return int(evidence[evidence.single(count, tau_s)].collided.sum())


@CLAIMS.judges("P29", "P39")
def baseline_crashes(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Collisions of the baseline: in Table 2.2 (P29) everywhere but at 5 m and 0.1 s, in Table 2.3 (P39) everywhere."""
    table = "2.2" if claim.id == "P29" else "2.3"
    cells = table_cells(evidence, table, ("baseline",))
    expected = [table == "2.3" or (cell.paper.desired_gap_m, cell.paper.tau_s) != CELLS[0] for cell in cells]
    hold = [cell.outcome.crash == crash for cell, crash in zip(cells, expected, strict=True)]
    return Finding.of_cases(hold, _cases(cells, hold))


@CLAIMS.judges("P30")
def heuristic_helps(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The heuristic's E_v against the baseline's, in Table 2.2."""
    without, cells = (table_cells(evidence, "2.2", (name,)) for name in ("baseline", "heuristic"))
    return _lower_errors(without, cells)


@CLAIMS.judges("P31")
def heuristic_avoids_crashes(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Collisions under the heuristic exactly at the largest tau."""
    cells = table_cells(evidence, "2.2", ("heuristic",))
    hold = [cell.outcome.crash == (cell.paper.tau_s == claim.number) for cell in cells]
    crashes = sum(cell.outcome.crash for cell in cells)
    return Finding.of_cases(hold, f"{crashes} of {len(cells)} cells crash; {_cases(cells, hold)}")


@CLAIMS.judges("P32", "P33")
def involved(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Vehicles involved in collisions at x_d = 4 m; the tau is not printed, so that nearest to the paper counts."""
    controller = "baseline" if claim.id == "P32" else "heuristic"
    outcomes = [_outcome(evidence, controller, 4.0, tau_s) for tau_s in TAUS_S]
    counts = [int(outcome.collided.sum()) for outcome in outcomes]
    nearest = min(counts, key=lambda count: abs(count - claim.number))
    rear = joined([int(outcome.rear_collided.sum()) for outcome in outcomes])
    shown = f"{joined(counts)} at tau {joined(list(TAUS_S), 'g')} s (as rear vehicles {rear})"
    return Finding(float(nearest), shown, of_number(nearest, claim.number))


@CLAIMS.judges("P34")
def baseline_stops(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Share of the intact vehicles that stop at x_d = 5 m, tau = 0.1 s."""
    share = _outcome(evidence, "baseline", *CELLS[0]).stopped_share()
    record = evidence[evidence.rear_speeds(((10, ATTACK_S),))]
    lowest = record.speed_mps[:, record.intact].min(axis=0)
    slower = ", ".join(f"{100.0 * float((lowest < limit).mean()):.1f} % < {limit:g} m/s" for limit in (1.0, 2.0))
    return Finding.of_number(share, claim, f"{share:.1f} % < 0.01 m/s, {slower}")


@CLAIMS.judges("P35")
def heuristic_stops(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Intact vehicles that come to a stop under the heuristic, cell by cell."""
    outcomes = [_outcome(evidence, "heuristic", *cell) for cell in CELLS]
    counts = [int((outcome.stops[outcome.intact] > 0).sum()) for outcome in outcomes]
    hold = [count == 0 for count in counts]
    return Finding.of_cases(hold, f"{joined(counts)} of {outcomes[0].intact.sum()} stop")


@CLAIMS.judges("P36")
def mitigations_equal(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Heuristic and MPC differ by no more than they do anywhere in the paper's Table 2.2."""
    pairs = zip(*(table_cells(evidence, "2.2", (name,)) for name in ("heuristic", "mpc")), strict=True)
    ours, paper = [], []
    for heuristic, mpc in pairs:
        ours.append(heuristic.ours - mpc.ours)
        paper.append(abs(heuristic.paper.velocity_error_percent - mpc.paper.velocity_error_percent))
    hold = [abs(difference) <= max(paper) for difference in ours]
    shown = f"MPC lower by {min(ours):.1f} to {max(ours):.1f} points (paper: at most {max(paper):.1f} apart)"
    return _tuned(Finding.of_cases(hold, shown))


@CLAIMS.judges("P40")
def heuristic_spares_vehicles(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Vehicles that collide under the heuristic against the baseline, in the cells of Table 2.2 where some do."""
    before, after = (
        [int(cell.outcome.collided.sum()) for cell in table_cells(evidence, "2.2", (name,))]
        for name in ("baseline", "heuristic")
    )
    cases = [pair for pair in zip(before, after, strict=True) if pair[0]]
    shown = f"{joined(before)} without, {joined(after)} with it; {applying(len(cases), len(before), 'cells')}"
    return Finding.of_comparisons([each[0] for each in cases], [each[1] for each in cases], shown)


@CLAIMS.judges("P41")
def mpc_helps(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The MPC's E_v against the baseline's, in Table 2.2, to which its weights were tuned."""
    without, cells = (table_cells(evidence, "2.2", (name,)) for name in ("baseline", "mpc"))
    return _tuned(_lower_errors(without, cells))


@CLAIMS.judges("P42")
def two_platoons_are_worse(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Cells with a collision in Table 2.3 against Table 2.2, by controller."""
    outcomes = {
        table: [[cell.outcome for cell in table_cells(evidence, table, (name,))] for name in CONTROLLERS]
        for table in ("2.2", "2.3")
    }
    crashes = {table: [sum(each.crash for each in row) for row in rows] for table, rows in outcomes.items()}
    collided = {
        table: joined([sum(int(each.collided.sum()) for each in row) for row in rows])
        for table, rows in outcomes.items()
    }
    shown = (
        f"cells with a collision {joined(crashes['2.3'])} in Table 2.3, {joined(crashes['2.2'])} in Table 2.2 "
        f"({', '.join(CONTROLLERS)}); vehicles in all cells {collided['2.3']} and {collided['2.2']}"
    )
    return Finding.of_comparisons(crashes["2.3"], crashes["2.2"], shown)


@CLAIMS.judges("P43")
def heuristic_computes_less(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Multiplications of a decision of one vehicle: the fewest, and the most, of both mitigations as they are built."""
    config = evidence.cell("2.2", "heuristic", *CELLS[0]).config
    limits = config.min_acceleration_mps2, config.max_acceleration_mps2
    fewer, more = heuristic_products(FORESIGHT, *limits), mpc_products(PAPER_MATCHING.horizon)
    shown = (
        f"a decision of one vehicle takes {fewer[0]:,} to {fewer[1]:,} multiplications against {more[0]:,} to "
        f"{more[1]:,}; the heuristic decides at every step, the MPC every {PAPER_MATCHING.period_s:g} s"
    )
    return Finding.of_comparisons(more, fewer, shown)


@CLAIMS.judges("P44")
def mitigations_avoid_crashes(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Cells of Table 2.3 without a collision, by mitigation."""
    free = [[not cell.outcome.crash for cell in table_cells(evidence, "2.3", (name,))] for name in CONTROLLERS[1:]]
    shown = f"{joined(list(map(sum, free)))} of {len(free[0])} cells ({', '.join(CONTROLLERS[1:])})"
    return Finding.of_cases(list(map(any, free)), shown)


def _lower_errors(without: Sequence[VelocityErrorPair], cells: Sequence[VelocityErrorPair]) -> Finding:
    before, after = ([cell.ours for cell in each] for each in (without, cells))
    gains = [one - other for one, other in zip(before, after, strict=True)]
    return Finding.of_comparisons(before, after, f"lower by {min(gains):.1f} to {max(gains):.1f} points")


def _tuned(finding: Finding) -> Finding:
    """About the MPC in Table 2.2, to which its weights were tuned: agreement supports nothing."""
    return replace(finding, verdict=by_construction(finding.verdict))


def _outcome(evidence: DisbandingEvidence, controller: str, desired_gap_m: float, tau_s: float) -> ScenarioOutcome:
    return evidence[evidence.cell("2.2", controller, desired_gap_m, tau_s)]


def _cases(cells: list[VelocityErrorPair], hold: list[bool]) -> str:
    """In how many cells a claim holds, and where not."""
    failing = [cell.name.partition(" ")[2] for cell, holds in zip(cells, hold, strict=True) if not holds]
    return f"holds in {sum(hold)} of {len(hold)} cells" + (f", not at {', '.join(failing)}" if failing else "")
