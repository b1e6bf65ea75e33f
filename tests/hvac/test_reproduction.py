"""`reproduce ch4` as a library: days, courses, verdicts, the reference, and the whole chapter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.building import discretise, weather
from cps_envs.hvac.sensors import sensor_sets
from cps_paper.chapter import Reproduction
from cps_paper.claims import Claim
from cps_paper.evidence import NotRunError
from cps_paper.hvac import deviation, experiments, impacts, observers, rules, weighing
from cps_paper.hvac.cells import CELL
from cps_paper.hvac.chapter import CHAPTER, EXHIBITS
from cps_paper.hvac.controllers import CLIP, CONTROLLERS, HvacEvidence, controller_named
from cps_paper.hvac.measures import measures, references
from cps_paper.hvac.rules import CLAIMS
from cps_paper.hvac.scenario import DayOutcome, DayScenario, RecordedDay
from cps_paper.verdicts import (
    GIVEN,
    NEAR,
    NOT,
    REPRODUCED,
    UNKNOWN,
    Tolerance,
    of_cell,
)
from tests.reproduced import as_published

PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"
SHORT = (("num_steps", 190), ("onset_step", 120), ("window_steps", 100))
FAST = ("4.2fig", "4.3fig", "4.5fig", "4.6fig", "claims")
LEFT_RANGES = ((11, 14), (24, 28), (32, 36), (38, 42), (46, 48))
LEFT_OUT = [f"C{k}" for first, last in LEFT_RANGES for k in range(first, last + 1)]


@pytest.fixture(scope="module")
def found() -> Reproduction[HvacEvidence]:
    todo = [each for part in FAST for each in CHAPTER.needed((part,), HvacEvidence(quick=True)) if part != "claims"]
    return Reproduction(CHAPTER, FAST, HvacEvidence({each: each.run() for each in dict.fromkeys(todo)}))


@pytest.fixture(scope="module")
def whole() -> Reproduction[HvacEvidence]:
    return CHAPTER.reproduce()


# Days


def test_a_day_is_that_of_the_environment_with_the_same_seed() -> None:
    days = DayScenario("random", "none", 3, SHORT).run().a_impact
    for seed, expected in enumerate(days.tolist()):
        env: Any = gymnasium.make("cps_envs:cps_envs/HvacDefense-v0", preset="paper", opponent="random", **dict(SHORT))
        env.reset(seed=seed)
        total, done = 0.0, False
        while not done:
            _, reward, done, _, info = env.step(0)
            total -= reward
        assert info["a_impact"] == pytest.approx(expected, rel=1e-12)
        assert total == pytest.approx(expected, rel=1e-9)


def test_impact_is_the_mean_over_the_states_since_a_step() -> None:
    course = RecordedDay("constant", "none", 2, SHORT).run()
    outcome = DayScenario("constant", "none", 2, SHORT).run()
    square = ((course.temperature_c - 25.0) ** 2).sum(axis=2)
    np.testing.assert_allclose(outcome.squared_error, square, rtol=1e-13)
    np.testing.assert_allclose(outcome.a_impact, square[120:].mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(outcome.impact_from(150), square[150:].mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(outcome.mean_abs_error_c, np.abs(course.temperature_c - 25.0).mean(axis=0), rtol=1e-12)


def test_intact_sets_are_those_without_an_attacked_sensor() -> None:
    course = RecordedDay("constant", "mtd1", 2, (*SHORT, ("num_compromised", 1))).run()
    sets = sensor_sets(course.config)
    for day in range(2):
        used = {int(choice) for choice in course.choice[100:, day]}
        assert course.distinct_sets[day] == len(used)
        assert course.intact_sets[day] == sum(2 not in sets[choice - 1] for choice in used)
    free = DayScenario("none", "mtd1", 2, SHORT).run()
    np.testing.assert_array_equal(free.intact_sets, free.distinct_sets)


def test_a_course_obeys_the_building_and_the_controller_gets_the_readings() -> None:
    course = RecordedDay("none", "none", 2, SHORT).run()
    A, B, G = discretise(course.config)
    x, u = course.temperature_c, course.heating_w
    w = weather(course.config, course.config.step_s * np.arange(len(x)))[:-1, np.newaxis]
    np.testing.assert_allclose(x[1:], x[:-1] @ A.T + B * u + G * w, atol=1e-10)
    np.testing.assert_allclose(course.estimate_c, course.reading_c[:-1], atol=1e-12)
    np.testing.assert_allclose(course.estimation_error_c, np.abs(course.reading_c - x)[:-1], atol=1e-12)
    assert course.level_percent.max() == pytest.approx(u.max() / 10.0)
    assert (course.between(1.0, 2.0), course.onset_step) == (slice(30, 60), 120)


# Parts


def test_quick_claims_need_neither_eight_sensors_nor_table_4_2() -> None:
    quick: set[Any] = set(CHAPTER.needed(("claims",), HvacEvidence(quick=True)))
    full = set(CHAPTER.needed(CHAPTER.chosen(), HvacEvidence()))
    assert quick < full
    assert not any(("num_sensors", 8) in each.settings for each in quick)
    assert not any("model_error" in dict(each.settings) for each in quick)
    assert len(full) > 150


def test_table_rows_use_the_sensors_that_they_name() -> None:
    for used, sensors in enumerate(experiments.TABLE_SENSORS, 1):
        cell = experiments.table_cell("4.1", 20, used)
        assert sensor_sets(cell.config)[used - 1] == sensors
        assert cell.defender == f"fixed?sensors=[{','.join(map(str, sensors))}]"
        assert cell.config.noise_std_c**2 == pytest.approx(0.2)
    assert experiments.table_cell("4.2", 5, 0).config.model_error == 0.05
    assert experiments.table_cell("4.2", 5, 0).config.noise_std_c == 0.0


# Rules


@pytest.mark.parametrize(
    ("ours", "paper", "verdict"),
    [
        (3.333, "3", REPRODUCED),
        (6.667, "6.6", REPRODUCED),
        (2.0, "1", NOT),
        (1.09, "1.00", NEAR),
        (1.4, "1", REPRODUCED),
    ],
)
def test_printed_numbers(ours: float, paper: str, verdict: str) -> None:
    assert rules.of_printed(ours, Claim("C00", "", "", paper, "h")) == verdict


def test_comparisons_need_five_percent() -> None:
    assert rules.rising([1.0, 1.04, 1.2]) == [False, True]
    assert rules.falling([1.2, 1.1, 1.09]) == [True, False]


def test_more_days_make_no_verdict_kinder() -> None:
    (claim,) = (each for each in CLAIMS.printed() if each.id == "C15")
    case = observers.LARGEST["C15"][0]
    wide = np.zeros((300, 9, 4))
    wide[-1, :, 0] = np.linspace(0.1, 2.0, 9)  # the paper's value is among them, their median is not
    config = SimpleNamespace(window_steps=200)
    course = SimpleNamespace(config=config, estimation_error_c=wide)
    (found,) = CLAIMS.evaluate(HvacEvidence({experiments.observed(*case): course}), [claim.id])
    assert found[1].verdict == NOT


@pytest.mark.parametrize(
    ("ours", "paper", "verdict"), [(0.39, 0.3, "match"), (0.45, 0.3, "near"), (0.51, 0.3, "miss"), (2.1, 2.0, "match")]
)
def test_cells(ours: float, paper: float, verdict: str) -> None:
    assert of_cell(ours, paper, *CELL) == verdict


def test_where_a_defence_fails() -> None:
    values = np.array([1.0, 1.5, 4.0, 20.0, 300.0])
    assert impacts.first_failing(values, 9.5) == 3
    assert impacts.first_failing(values, 1000.0) is None
    assert impacts.first_failing(np.array([50.0, 1.0]), 9.5) is None
    low, high = impacts.lines_giving(values, 3)
    assert (low, high) == (4.0, 20.0)
    assert impacts.first_failing(values, low) == impacts.first_failing(values, high - 1e-9) == 3


def test_up_to_where_an_impact_equals_the_attack_free_one() -> None:
    assert impacts.equal_up_to([made(each) for each in (1.0, 1.2, 2.1, 1.0)]) == 1
    assert impacts.equal_up_to([made(each) for each in (1.0, 1.0, 1.0)]) == 2


# Verdicts on made-up days: what the paper claims, and its opposite


def made(impact: float, sets: int = 3) -> DayOutcome:
    numbers = np.full(2, sets)
    return DayOutcome(np.full((720, 2), impact), np.zeros((2, 4)), 200, numbers, numbers, 0 * numbers, 519)


def bars(num_sensors: int, mtd1: dict[str, int], mtd2: int | None) -> dict[Any, DayOutcome]:
    """Days on which MTD1 fails at these counts by attack, and MTD2 at another under either fallback."""
    days: dict[Any, DayOutcome] = {}
    for attacker in experiments.ATTACKS:
        for count in range(num_sensors + 1):
            sets = num_sensors - count
            days[experiments.compared(num_sensors, attacker, "none", count)] = made(10.0 + 100.0 * count)
            failed = 0 < mtd1[attacker] <= count
            days[experiments.compared(num_sensors, attacker, "mtd1", count)] = made(200.0 if failed else 1.0)
            failed = mtd2 is not None and mtd2 <= count
            for name in ("mtd2", experiments.MODEL_FALLBACK):
                days[experiments.compared(num_sensors, attacker, name, count)] = made(200.0 if failed else 1.0, sets)
    return days


def verdicts(days: dict[Any, Any], only: tuple[str, ...]) -> dict[str, str]:
    return {claim.id: finding.verdict for claim, finding in CLAIMS.evaluate(HvacEvidence(days), only)}


def test_claims_about_defences_follow_the_days() -> None:
    four, eight = ("C32", "C33", "C34", "C35", "C36"), ("C38", "C39", "C40", "C41", "C42")
    as_printed = bars(4, dict.fromkeys(experiments.ATTACKS, 2), 4)
    assert set(verdicts(as_printed, four).values()) == {REPRODUCED}
    weak = bars(4, dict.fromkeys(experiments.ATTACKS, 1), 3)
    assert verdicts(weak, four) == {**dict.fromkeys(four, NOT), "C36": REPRODUCED}
    as_printed = bars(8, {"constant": 6, "sine": 7, "random": 5}, 8)
    assert set(verdicts(as_printed, eight).values()) == {REPRODUCED}
    stands = verdicts(bars(8, dict.fromkeys(experiments.ATTACKS, 0), None), eight)
    assert (stands["C38"], stands["C39"]) == (NOT, NOT)


def test_claims_about_undefended_attacks_follow_the_days() -> None:
    days = {experiments.undefended(a, count): made(10.0 * count) for a in experiments.ATTACKS for count in range(5)}
    assert verdicts(days, ("C11", "C12")) == {"C11": REPRODUCED, "C12": NOT}
    days = {each: made(149.253) for each in days}
    assert verdicts(days, ("C11", "C12")) == {"C11": NOT, "C12": GIVEN}


def test_a_claim_whose_days_were_left_out_stays_open() -> None:
    assert verdicts({}, ("C11", "C37")) == {"C11": UNKNOWN, "C37": GIVEN}


# The reference


def test_reference_has_a_reason_for_every_number_outside() -> None:
    known = references()
    assert len(known) == 176
    assert sum(each.recorded is not None for each in known.values()) == 7
    for each in known.values():
        assert (each.recorded is None) == (each.reason == "")
        assert each.tolerance.kind in ("absolute", "share", "factor")
        assert each.recorded is None or not each.tolerance.admits(each.recorded, each.value)


@pytest.mark.parametrize(
    ("kind", "tolerance", "inside", "outside"),
    [("absolute", 0.5, 2.5, 2.6), ("share", 0.1, 1.8, 1.7), ("factor", 2, 4, 4.1), ("below", 1, 1, 0.9)],
)
def test_tolerances(kind: str, tolerance: float, inside: float, outside: float) -> None:
    stated = Tolerance(tolerance, kind)
    assert stated.admits(inside, 2.0)
    assert not stated.admits(outside, 2.0)


def test_a_number_that_left_the_reference_fails_and_is_named(found: Reproduction[HvacEvidence]) -> None:
    assert found.passed
    energy_w = experiments.ENERGIES_W[0]
    course = found.evidence[experiments.noise_free(energy_w)]
    warmer = replace(course, temperature_c=course.temperature_c + 0.1)
    changed = Reproduction(CHAPTER, ("4.2fig",), HvacEvidence({experiments.noise_free(energy_w): warmer}))
    assert not changed.passed
    assert any("FAILED: clear day: zone 1 before noon 0.95" in paragraph for paragraph in changed.closing())


# What runs in seconds


def test_fast_verdicts_are_the_published_ones(found: Reproduction[HvacEvidence]) -> None:
    document = as_published(found, LEFT_OUT)
    assert list(document["parts"]) == list(FAST)
    assert document["regression"]["passed"]
    assert [row["zone"] for row in document["parts"]["4.2fig"]] == [1, 2, 3, 4]
    assert len(document["parts"]["4.6fig"]) == 14


def test_fast_values(found: Reproduction[HvacEvidence]) -> None:
    values = {claim.id: finding.value for claim, finding in found.findings[""]}
    expected = {"C01": 1.18, "C10": 0.86, "C15": 0.444, "C16": 0.436, "C17": 0.143, "C19": 7.66, "C20": 7.11}
    for name, value in expected.items():
        assert values[name] == pytest.approx(value, rel=0.005), name
    assert [values[name] for name in ("C06", "C07", "C08")] == [2.0, 5.0, 25.0]
    assert values["C30"] == (1.0, 2.0, 3.0, 4.0, 8.0, 9.0, 10.0, 11.0)


def test_closing_speaks_of_what_was_computed(found: Reproduction[HvacEvidence]) -> None:
    text = " ".join(found.closing())
    for words in ("settles at 1 %", "consistent with itself", "not evaluated: C11", "are one calibrated set"):
        assert words in text
    assert "what MTD2 does when no set passes" not in text
    with_claim = Reproduction(CHAPTER, ("claims",), HvacEvidence(bars(4, dict.fromkeys(experiments.ATTACKS, 2), None)))
    assert "what MTD2 does when no set passes" in " ".join(with_claim.closing())


@pytest.mark.parametrize("part", [part for part in FAST if part != "claims"])
def test_fast_figures_are_drawn(found: Reproduction[HvacEvidence], part: str) -> None:
    pytest.importorskip("matplotlib")
    figure = draw(found.evidence, part)
    assert all(panel.lines for panel in figure.axes)


def draw(evidence: HvacEvidence, part: str) -> Any:
    """The figure of a part."""
    (drawn,) = (each.figures for each in EXHIBITS if each.name == part)
    return next(iter(drawn.values()))(evidence)


def test_figures_need_their_days() -> None:
    with pytest.raises(NotRunError):
        draw(HvacEvidence(), "4.7fig")


@pytest.mark.parametrize("num_sensors", [4, 8])
def test_bars_are_drawn_and_listed(num_sensors: int) -> None:
    pytest.importorskip("matplotlib")
    part = {4: "4.7fig", 8: "4.8fig"}[num_sensors]
    made_up = Reproduction(
        CHAPTER, (part,), HvacEvidence(bars(num_sensors, dict.fromkeys(experiments.ATTACKS, 2), num_sensors))
    )
    ((name, figure),) = made_up.figures()
    assert name == f"figure_4_{part[2]}"
    assert len(figure.axes) == 4
    impact, sets = made_up.tables()
    assert len(impact.rows) == 9
    assert impact.rows[0][:4] == ("constant", "none", "10.0 ± 0.0", "110 ± 0")
    assert len(sets.rows) == 4
    document = made_up.document()["parts"][part]
    assert document["bars"]["sine"]["mtd1"][2]["a_impact"]["mean"] == pytest.approx(200.0)
    assert document["failing_line_c2"] == pytest.approx(10.0)


# The whole chapter


@pytest.mark.slow
def test_whole_chapter_is_within_the_reference(whole: Reproduction[HvacEvidence]) -> None:
    assert len(whole.checks) == len(references())
    assert all(check.inside == (check.reference.recorded is None) for check in whole.checks)
    assert whole.passed


@pytest.mark.slow
def test_verdicts_that_change_over_other_days() -> None:
    found = CHAPTER.reproduce(("claims",), jobs=2, recheck=True)
    as_published(found)
    (again,) = found.again[""]
    changed = {claim.id for claim, finding in found.findings[""] if again.differs(claim.id, finding.verdict)}
    shown = {claim.id: finding.shown for claim, finding in found.findings[""]}
    assert all(("over other days" in words) == (name in changed) for name, words in shown.items())
    assert f"{48 - len(changed)} of 48 verdicts stay" in found.closing()[-1]


@pytest.mark.slow
def test_whole_output(whole: Reproduction[HvacEvidence]) -> None:
    pytest.importorskip("matplotlib")
    assert [name for name, _ in whole.figures()] == [f"figure_4_{number}" for number in range(2, 9)]
    assert len(whole.tables()) == 14
    assert list(as_published(whole)["parts"]) == list(CHAPTER.parts)
    assert "169 of 176 numbers" in " ".join(whole.closing())
    assert len({(each.group, each.case) for each in measures(whole.evidence)}) == len(measures(whole.evidence))


def test_a_controller_stands_in_for_the_other_in_every_experiment() -> None:
    qp = controller_named("qp")
    parts = [part for part in CHAPTER.chosen() if part != "deviation"]  # its rows name their controller
    for one in CHAPTER.needed(parts, HvacEvidence()):
        assert CLIP.under(one) == one
        two: Any = qp.under(one)
        assert isinstance(one, DayScenario)
        assert dict(two.settings) == {**dict(qp.settings), **dict(one.settings)}
        assert two.config.controller == "qp"
        assert (two.attacker, two.defender, two.days) == (one.attacker, one.defender, one.days)
    with pytest.raises(ConfigurationError, match="Known: clip, qp, levels"):
        controller_named("pid")


def test_the_chapter_can_be_computed_with_each_controller() -> None:
    largest = {}
    for name in CONTROLLERS:
        chapter = CHAPTER.reproduce(("4.2fig",), controller=name)
        document = chapter.document()
        assert document["controller"] == name
        assert bool(document["regression"]["checks"]) == (name == "clip")
        assert chapter.passed
        assert any(words.startswith(f"Controller: {name}") for words in document["closing"])
        largest[name] = [zone["morning_error_c"] for zone in document["parts"]["4.2fig"]]
    assert len({tuple(errors) for errors in largest.values()}) == 3


def test_the_weight_of_a_controller_gives_the_printed_impact() -> None:
    qp = controller_named("qp")
    assert weighing.impact_c2(dict(qp.settings)) == pytest.approx(weighing.PRINTED_C2, rel=0.02)
    assert deviation.printed_errors_c() == pytest.approx([0.456, 1.633, 2.798, 3.830], abs=2e-3)


def test_a_reading_of_table_4_1_is_judged_beside_the_attack_that_it_moves() -> None:
    row = deviation.DeviationRow(60, 0.05, (0.85, 1.76, 2.77, 3.80), 625.0)
    assert (row.error_verdicts, row.impact_verdict) == ("reproduced 2, near 1, not reproduced 1", "not reproduced")
    assert replace(row, impact_c2=150.0).impact_verdict == "reproduced"


def test_the_percentages_of_table_4_1_may_be_standard_deviations() -> None:
    found = CHAPTER.reproduce(("deviation",), jobs=1)
    (table,) = found.tables()
    ours = table.records[1:]
    assert [row.weight for row in ours] == [0.05, 0.25, 0.25]
    assert ours[0].errors_c == pytest.approx([0.85, 1.76, 2.77, 3.80], abs=0.005)
    assert ours[1].impact_c2 == pytest.approx(150, abs=0.5)
    for row in ours:  # no controller has both
        assert "not reproduced" in row.error_verdicts or row.impact_verdict == "not reproduced"
