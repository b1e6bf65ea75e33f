"""The claims of section 2.4.3 about the tables: P29 to P36 and P39."""

from __future__ import annotations

from cps_baselines.disbanding.reproduction.cells import Cell, table_cells
from cps_baselines.disbanding.reproduction.experiments import ATTACK_S, CELLS, TAUS_S, Evidence
from cps_baselines.disbanding.reproduction.rules import CLAIMS
from cps_baselines.disbanding.reproduction.scenario import Outcome
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.verdicts import of_cases, of_number


@CLAIMS.judges("P29", "P39")
def baseline_crashes(evidence: Evidence, claim: Claim) -> Finding:
    """Collisions of the baseline: in Table 2.2 (P29) everywhere but at 5 m and 0.1 s, in Table 2.3 (P39) everywhere."""
    table = "2.2" if claim.id == "P29" else "2.3"
    cells = table_cells(evidence, table, ("baseline",))
    expected = [table == "2.3" or (cell.paper.desired_gap_m, cell.paper.tau_s) != CELLS[0] for cell in cells]
    hold = [cell.outcome.crash == crash for cell, crash in zip(cells, expected, strict=True)]
    return Finding(all(hold), _cases(cells, hold), of_cases(hold))


@CLAIMS.judges("P30")
def heuristic_helps(evidence: Evidence, claim: Claim) -> Finding:
    """The heuristic's E_v against the baseline's, in Table 2.2."""
    without, cells = (table_cells(evidence, "2.2", (name,)) for name in ("baseline", "heuristic"))
    gains = [before.ours - after.ours for before, after in zip(without, cells, strict=True)]
    hold = [gain > 0.0 for gain in gains]
    return Finding(all(hold), f"lower by {min(gains):.1f} to {max(gains):.1f} points", of_cases(hold))


@CLAIMS.judges("P31")
def heuristic_avoids_crashes(evidence: Evidence, claim: Claim) -> Finding:
    """Collisions under the heuristic exactly at the largest tau."""
    cells = table_cells(evidence, "2.2", ("heuristic",))
    hold = [cell.outcome.crash == (cell.paper.tau_s == claim.number) for cell in cells]
    crashes = sum(cell.outcome.crash for cell in cells)
    return Finding(all(hold), f"{crashes} of {len(cells)} cells crash; {_cases(cells, hold)}", of_cases(hold))


@CLAIMS.judges("P32", "P33")
def involved(evidence: Evidence, claim: Claim) -> Finding:
    """Vehicles involved in collisions at x_d = 4 m; the tau is not printed, so that nearest to the paper counts."""
    controller = "baseline" if claim.id == "P32" else "heuristic"
    outcomes = [_outcome(evidence, controller, 4.0, tau_s) for tau_s in TAUS_S]
    counts = [int(outcome.collided.sum()) for outcome in outcomes]
    nearest = min(counts, key=lambda count: abs(count - claim.number))
    rear = joined([int(outcome.rear_collided.sum()) for outcome in outcomes])
    shown = f"{joined(counts)} at tau {joined(list(TAUS_S), 'g')} s (as rear vehicles {rear})"
    return Finding(float(nearest), shown, of_number(nearest, claim.number))


@CLAIMS.judges("P34")
def baseline_stops(evidence: Evidence, claim: Claim) -> Finding:
    """Share of the intact vehicles that stop at x_d = 5 m, tau = 0.1 s."""
    share = _outcome(evidence, "baseline", *CELLS[0]).stopped_share()
    record = evidence[evidence.experiments.rear_speeds(((10, ATTACK_S),))]
    lowest = record.speed_mps[:, record.outcome.intact].min(axis=0)
    slower = ", ".join(f"{100.0 * float((lowest < limit).mean()):.1f} % < {limit:g} m/s" for limit in (1.0, 2.0))
    return Finding(share, f"{share:.1f} % < 0.01 m/s, {slower}", of_number(share, claim.number))


@CLAIMS.judges("P35")
def heuristic_stops(evidence: Evidence, claim: Claim) -> Finding:
    """Intact vehicles that come to a stop under the heuristic, cell by cell."""
    outcomes = [_outcome(evidence, "heuristic", *cell) for cell in CELLS]
    counts = [int((outcome.stops[outcome.intact] > 0).sum()) for outcome in outcomes]
    hold = [count == 0 for count in counts]
    return Finding(all(hold), f"{joined(counts)} of {outcomes[0].intact.sum()} stop", of_cases(hold))


@CLAIMS.judges("P36")
def mitigations_equal(evidence: Evidence, claim: Claim) -> Finding:
    """Heuristic and MPC differ by no more than they do anywhere in the paper's Table 2.2."""
    pairs = zip(*(table_cells(evidence, "2.2", (name,)) for name in ("heuristic", "mpc")), strict=True)
    ours, paper = [], []
    for heuristic, mpc in pairs:
        ours.append(heuristic.ours - mpc.ours)
        paper.append(abs(heuristic.paper.velocity_error_percent - mpc.paper.velocity_error_percent))
    hold = [abs(difference) <= max(paper) for difference in ours]
    shown = f"MPC lower by {min(ours):.1f} to {max(ours):.1f} points (paper: at most {max(paper):.1f} apart)"
    return Finding(all(hold), shown, of_cases(hold))


def _outcome(evidence: Evidence, controller: str, desired_gap_m: float, tau_s: float) -> Outcome:
    return evidence[evidence.experiments.cell("2.2", controller, desired_gap_m, tau_s)]


def _cases(cells: list[Cell], hold: list[bool]) -> str:
    """In how many cells a claim holds, and where not."""
    failing = [cell.name.partition(" ")[2] for cell, holds in zip(cells, hold, strict=True) if not holds]
    return f"holds in {sum(hold)} of {len(hold)} cells" + (f", not at {', '.join(failing)}" if failing else "")
