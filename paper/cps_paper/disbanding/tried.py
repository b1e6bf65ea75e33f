"""Readings of the text that were tried because a claim fails: how many, and what each gives for that claim.

The more are tried, the likelier one fits by chance. So they stand beside the claim and change no verdict of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

from cps_envs.disbanding.config import DisbandingConfig
from cps_paper.disbanding.experiments import ATTACK_S, CELLS, STRINGS, DisbandingEvidence
from cps_paper.disbanding.played import PlayedScenario
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import Attack, Scenario
from cps_paper.evidence import Experiment
from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.verdicts import REPRODUCED, of_cases, of_number

PERIODS_S = (0.01, 0.02, 0.05, 0.1)  # after which the heuristic is repeated
COUNTS, FIRSTS, TAUS_S = (6, 7, 8, 9, 10), (20, 19), (0.1, 0.2, 0.3)  # disbanded platoons, the first of them
APART_S, DURATION_S = 30.0, 600.0  # of every other platoon, Fig. 2.1e


def periods_s(evidence: DisbandingEvidence) -> list[float]:
    """The periods that are whole integration steps of the interpretation."""
    step_s = DisbandingConfig(interpretation=evidence.interpretation).dynamics.dt_s
    return [period_s for period_s in PERIODS_S if math.isclose(period_s / step_s, round(period_s / step_s))]


def repeated(evidence: DisbandingEvidence, period_s: float) -> list[PlayedScenario]:
    """The cells of Table 2.2 with the heuristic repeated so often, its correction held in between."""
    chosen = ("interpretation", evidence.interpretation)
    return [
        PlayedScenario("heuristic", tau_s, (("desired_gap_m", gap_m), ("control_period_s", period_s), chosen))
        for gap_m, tau_s in CELLS
    ]


def disbanded(evidence: DisbandingEvidence, count: int, first: int, tau_s: float) -> Scenario:
    """So many of 20 platoons are disbanded, every other one from `first` on."""
    attack: Attack = tuple((first - 2 * i, ATTACK_S + APART_S * i) for i in range(count))
    chosen = evidence.interpretation
    return Scenario(attack, tau_s, interpretation=chosen, num_platoons=STRINGS[0], duration_s=DURATION_S)


def combinations() -> list[tuple[int, int, float]]:
    """Counts, first platoons and lags."""
    return list(product(COUNTS, FIRSTS, TAUS_S))


def tried(evidence: DisbandingEvidence) -> list[Experiment[Any]]:
    """All of it."""
    first = [each for period_s in periods_s(evidence) for each in repeated(evidence, period_s)]
    return [*first, *(disbanded(evidence, *each) for each in combinations())]


def collided(evidence: DisbandingEvidence, period_s: float) -> list[int]:
    """How many vehicles collide in each cell of Table 2.2."""
    return [round(evidence[each]["collided"]) for each in repeated(evidence, period_s)]


def verdict_of_period(evidence: DisbandingEvidence, period_s: float) -> str:
    """That of P31: collisions exactly at the largest lag."""
    largest, counts = CLAIMS.number("P31"), collided(evidence, period_s)
    return of_cases([(count > 0) == (tau_s == largest) for count, (_, tau_s) in zip(counts, CELLS, strict=True)])


def verdict_of_count(evidence: DisbandingEvidence, each: tuple[int, int, float]) -> str:
    """That of P20: the share of the intact vehicles in collisions."""
    return of_number(evidence[disbanded(evidence, *each)].collided_share(), CLAIMS.number("P20"))


def tried_tables(evidence: DisbandingEvidence) -> list[ExhibitTable]:
    """Both as tables of text."""
    lengths_s = periods_s(evidence)
    periods = (
        Column("repeated every", lambda period_s: period_s, "{:g} s"),
        *across(
            range(len(CELLS)),
            lambda k: "{:g} m, {:g} s".format(*CELLS[k]),
            lambda period_s, k: collided(evidence, period_s)[k],
        ),
        Column("P31", lambda period_s: verdict_of_period(evidence, period_s)),
    )
    counts = (
        Column("disbanded", lambda each: each[0]),
        Column("first", lambda each: each[1]),
        Column("tau", lambda each: each[2], "{:g} s"),
        Column("in collisions", lambda each: evidence[disbanded(evidence, *each)].collided_share(), "{:.1f} %"),
        *across(
            STOPS, STOPS.__getitem__, lambda each, n: evidence[disbanded(evidence, *each)].stopped_share(n), "{:.1f} %"
        ),
        Column("P20", lambda each: verdict_of_count(evidence, each)),
    )
    return [
        ExhibitTable(
            f"P31, {len(lengths_s)} periods tried: vehicles that collide under the heuristic", periods, lengths_s
        ),
        ExhibitTable(f"P20, {len(combinations())} combinations tried", counts, combinations(), (_note(evidence),)),
    ]


STOPS = {1: "stop once", 2: "twice", 3: "three times"}


def _note(evidence: DisbandingEvidence) -> str:
    fits: Sequence[Any] = [each for each in combinations() if verdict_of_count(evidence, each) == REPRODUCED]
    named = "; ".join(f"{count} from platoon {first} on, tau {tau_s:g} s" for count, first, tau_s in fits) or "none"
    return (
        f"Paper: {CLAIMS.number('P20'):g} %. {len(fits)} of {len(combinations())} combinations fit: {named}. With ten "
        "disbanded platoons 100 vehicles are intact, and 37.5 % of them (P19) is no whole number; with eight it is 45 "
        "of 120."
    )


def tried_data(evidence: DisbandingEvidence) -> dict[str, Any]:
    """The same for JSON."""
    return {
        "heuristic_periods": [
            {"period_s": each, "collided": collided(evidence, each), "P31": verdict_of_period(evidence, each)}
            for each in periods_s(evidence)
        ],
        "every_other": [
            {
                "disbanded": each[0],
                "first": each[1],
                "tau_s": each[2],
                "collided_percent": evidence[disbanded(evidence, *each)].collided_share(),
                "P20": verdict_of_count(evidence, each),
            }
            for each in combinations()
        ],
    }
