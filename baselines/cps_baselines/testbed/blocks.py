"""The reproduction as tables for readers."""

from __future__ import annotations

from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.findings import Findings, findings_block
from cps_baselines.testbed.cases import CASES, Case
from cps_baselines.testbed.claims import CLAIMS, RULES, deviation
from cps_baselines.testbed.reference import references
from cps_baselines.testbed.results import ORDERED_SHARE, Results

COLUMNS = ("", "Paper", "Ours", "±", "min", "max", "Diff.", "Reference", "±", "lowest m/s", "stop", "gap m", "rms m/s²")


def printed_errors() -> dict[str, float]:
    """The paper's E_v in percent by claim."""
    return {claim.id: claim.number for claim in CLAIMS.printed() if claim.id in {case.claim for case in CASES}}


def cases_block(results: Results) -> Block:
    """The three cases beside the paper and the reference, means over the seeds."""
    note = (
        f"E_v (2.8) in percent of robots 1 to 6, true speeds, 20 to 50 s; mean and standard deviation over "
        f"{results.num_seeds} seeds, the same for every case. Reference: our own second implementation of the same "
        "model, other seeds. Then means of: lowest speed, robots that stop, smallest gap (bodies touch at 0.100 m) and "
        "rms acceleration."
    )
    return Block("Fig. 2.5 on the simulated test bed", COLUMNS, [_row(results, case) for case in CASES], 1, (note,))


def _row(results: Results, case: Case) -> list[str]:
    errors, metrics, reference = results.errors(case), results.of(case).metrics, references()[case.figure]
    paper = printed_errors()[case.claim]
    numbers = (errors.min(), errors.max())
    return [
        f"{case.figure} {case.name}",
        f"{paper:.2f}",
        f"{errors.mean():.2f}",
        f"{deviation(errors):.2f}",
        *(f"{value:.1f}" for value in numbers),
        f"{errors.mean() - paper:+.1f}",
        f"{reference.mean:.1f}",
        f"{reference.deviation:.1f}",
        f"{metrics['lowest_speed_mps'].mean():.3f}",
        f"{metrics['stopped'].mean():.1f}",
        f"{metrics['smallest_gap_m'].mean():.3f}",
        f"{metrics['rms_acceleration_mps2'].mean():.3f}",
    ]


def seeds_block(results: Results) -> Block:
    """E_v of each seed in each case."""
    errors = [results.errors(case) for case in CASES]
    rows = [
        (str(seed), *(f"{values[seed]:.2f}" for values in errors), "yes" if results.ordered[seed] else "no")
        for seed in range(results.num_seeds)
    ]
    ordered = f"{results.ordered.sum()} of {results.num_seeds} seeds"
    note = f"E_v falls from case to case in {ordered}; asked for: {ORDERED_SHARE:.0%}."
    return Block("E_v by seed / %", ("Seed", *(case.name for case in CASES), "in order"), rows, 1, (note,))


def claims_block(findings: Findings) -> Block:
    """Every claim with its verdict."""
    return findings_block(findings, RULES)
