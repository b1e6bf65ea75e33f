"""Judging claims again: what is computed, what counts as a change, and how it is said."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_paper.claims import Claim, Finding
from cps_paper.disbanding.chapter import CHAPTER as CHAPTER_2
from cps_paper.disbanding.experiments import DisbandingEvidence, PlanSearch
from cps_paper.disbanding.rules import CONDITIONS as OTHER_RULES
from cps_paper.disbanding.scenario import Recorded, Scenario
from cps_paper.evidence import Evidence, NotRunError, compute
from cps_paper.hvac.chapter import CHAPTER as CHAPTER_4
from cps_paper.hvac.chapter import CONDITIONS as OTHER_DAYS
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import noise_free, undefended
from cps_paper.hvac.scenario import DayScenario
from cps_paper.recheck import (
    Again,
    Condition,
    again_document,
    again_summary,
    judge_again,
    with_again,
)
from cps_paper.rogue.chapter import CONDITIONS, WORLDS, behind_claims
from cps_paper.rogue.experiments import ClosedLoop, Ride, Waves, square_waves
from cps_paper.verdicts import NOT, REPRODUCED, UNKNOWN, of_number
from tests.baselines.test_exhibit import Number

CLAIM = Claim("X01", "1", "it is one", "1", "m")


def larger(experiment: Any) -> Any:
    return replace(experiment, value=2.0 * experiment.value)


def same(experiment: Any) -> Any:
    return experiment


TWICE, BOTH = Condition("at twice", (larger,)), Condition("in 3 worlds", (larger, same, larger))


def judged(evidence: Evidence) -> list[tuple[Claim, Finding]]:
    value = evidence[Number(1.0)]
    return [(CLAIM, Finding(value, f"{value:g} m", of_number(value, 1.0)))]


def test_a_verdict_that_changes_says_so() -> None:
    todo = [Number(1.0), *TWICE.experiments([Number(1.0)])]
    assert todo == [Number(1.0), Number(2.0)]
    results = Evidence(compute(todo))
    again = judge_again(results, (TWICE, BOTH), judged)
    assert [each.counts for each in again] == [{"X01": {NOT: 1}}, {"X01": {NOT: 2, REPRODUCED: 1}}]
    ((_, finding),) = with_again(judged(results), again)
    assert finding.verdict == REPRODUCED
    assert finding.shown == "1 m; at twice: not reproduced; in 3 worlds: 2 not reproduced, 1 reproduced"
    assert again_summary(judged(results), again) == [
        "Judged again at twice: 0 of 1 verdicts stay. Changed: X01 not reproduced.",
        "Judged again in 3 worlds: 0 of 1 verdicts stay. Changed: X01 2 not reproduced, 1 reproduced.",
    ]
    assert again_document(again)["at twice"] == {"X01": {NOT: 1}}


def test_a_verdict_that_stays_is_left_alone() -> None:
    results = Evidence(compute([Number(1.0)]))
    again = judge_again(results, (Condition("as before", (same, same)),), judged)
    assert with_again(judged(results), again) == judged(results)
    assert again_summary(judged(results), again) == ["Judged again as before: 1 of 1 verdicts stay."]
    left_out = [(CLAIM, Finding(None, "left out", UNKNOWN))]
    assert again_summary(left_out, [Again("as before", {"X01": {UNKNOWN: 1}})]) == [
        "Judged again as before: 0 of 0 verdicts stay."
    ]


def test_what_was_not_computed_is_not_taken_from_the_usual_results() -> None:
    usual = Evidence(compute([Number(1.0)]))
    with pytest.raises(NotRunError):
        usual.varied(larger)[Number(1.0)]
    assert usual.varied(same)[Number(1.0)] == 1.0


def test_chapter_2_is_judged_again_at_half_the_step_and_under_its_own_rules() -> None:
    half, standing, transitional = OTHER_RULES
    usual = Scenario(((3, 1.0),), tau_s=0.5, num_platoons=3, duration_s=20.0)
    coarse = replace(usual, interpretation="S1")
    for scenario, step_s in ((usual, 0.005), (coarse, 0.01)):
        (fine,) = half.experiments([scenario])
        assert fine == replace(scenario, overrides=(("dt_s", step_s),))
        assert fine.cost == 2.0 * scenario.cost
    errors = {
        name: condition.experiments([usual])[0].run().velocity_error_intact
        for name, condition in (("half", half), ("standing", standing), ("transitional", transitional))
    }
    errors["usual"] = usual.run().velocity_error_intact
    assert len(set(errors.values())) == 4
    assert errors["half"] == pytest.approx(errors["usual"], abs=0.5)
    assert not standing.experiments([usual])[0].run().crash
    (course,) = half.experiments([Recorded(**vars(usual), sample_s=1.0)])
    assert course == Recorded(**vars(replace(usual, overrides=(("dt_s", 0.005),))), sample_s=1.0)
    assert course.run().velocity_error_intact == errors["half"]
    every = CHAPTER_2.needed(("claims",), DisbandingEvidence())
    for condition in OTHER_RULES:
        assert not set(condition.experiments(every)) & set(every)
    with pytest.raises(TypeError, match="no claim needs"):
        half.experiments([PlanSearch(1, 0.1)])


@pytest.mark.slow
def test_chapter_2_says_which_verdicts_change() -> None:
    found = CHAPTER_2.reproduce(("claims",), quick=True, recheck=True)
    changed = {name for name, verdict in _verdicts(found) if found.again[""][1].differs(name, verdict)}
    assert {"P27", "P29", "P39"} <= changed  # nobody collides under the standstill rule
    assert "P21" not in changed
    assert len([line for line in found.closing() if line.startswith("Judged again")]) == len(OTHER_RULES)
    assert set(found.document()["again"]) == {condition.name for condition in OTHER_RULES}


def _verdicts(found: Any) -> list[tuple[str, str]]:
    return [(claim.id, finding.verdict) for claim, finding in found.findings[""]]


def test_chapter_4_is_judged_again_over_days_of_other_seeds() -> None:
    (condition,) = OTHER_DAYS
    every = CHAPTER_4.needed(("claims",), HvacEvidence())
    others = condition.experiments(every)
    assert len(others) == len(every)
    assert not set(others) & set(every)
    for mine, theirs in zip(every, others, strict=True):
        assert isinstance(theirs, DayScenario)
        assert replace(theirs, first_seed=0, days=mine.days) == mine
        assert theirs.days == max(mine.days, 20) or (mine.days == theirs.days == 1 and not mine.config.noise_std_c)
    short = replace(
        undefended("constant", 1), days=2, settings=(("num_steps", 190), ("onset_step", 120), ("window_steps", 100))
    )
    (moved,) = condition.experiments([short])
    alone = replace(short, days=1, first_seed=1000).run()
    assert moved.days == 20
    np.testing.assert_array_equal(moved.run().squared_error[:, :1], alone.squared_error)
    assert (short.run().squared_error[:, :1] != alone.squared_error).any()
    quiet = noise_free(1000.0)
    assert condition.variants[0](quiet) == replace(quiet, first_seed=1000)


def test_chapter_5_is_judged_again_at_half_the_step_and_in_other_worlds() -> None:
    half, worlds = CONDITIONS
    usual = Waves("pd", 1.2, duration_s=20.0, waves=square_waves((0.1,)))
    (fine,) = half.experiments([usual])
    assert dict(fine.overrides)["dt_s"] == 0.0005
    assert fine.cost == 2.0 * usual.cost
    other = worlds.experiments([usual])
    assert len(set(other)) == WORLDS == 20
    damages = [float(each.run()[0]) for each in (usual, fine, *other[:2])]
    assert len(set(damages)) == 4
    assert damages == pytest.approx([damages[0]] * 4, rel=0.2)
    ride = Ride("pd", 1.2, duration_s=20.0, attacker="square?frequency_hz=0.1")
    for condition, expected in ((half, damages[1]), (worlds, damages[2])):
        assert condition.variants[0](ride).run().final_damage == expected
    assert len(half.experiments(behind_claims())) == len(behind_claims())
    with pytest.raises(TypeError, match="no claim needs"):
        half.experiments([ClosedLoop("pd", "pd", 1.0)])
