"""`reproduce ch2` as a library: cells against the reference, claims, verdicts, and running experiments."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_agents.console import to_json
from cps_baselines.disbanding.heuristic_policy import FORESIGHT
from cps_baselines.disbanding.mpc import PAPER_MATCHING, design_mpc
from cps_envs.disbanding.config import PAPER
from cps_paper.chapter import Reproduction
from cps_paper.disbanding import plots
from cps_paper.disbanding.cells import mean_distance, references, table_cells
from cps_paper.disbanding.chapter import CHAPTER
from cps_paper.disbanding.effort import heuristic_products, mpc_products
from cps_paper.disbanding.experiments import DisbandingEvidence, evaluator
from cps_paper.disbanding.played import READINGS, PlayedScenario
from cps_paper.disbanding.scenario import CONTROLLERS, Recorded, Scenario, ScenarioOutcome
from cps_paper.disbanding.summary import cells_of
from cps_paper.disbanding.tried import disbanded, tried, tried_data, tried_tables
from cps_paper.printed.tables import velocity_errors
from cps_paper.verdicts import (
    NEAR,
    NEAR_SHARE,
    NOT,
    PARTLY,
    REPRODUCED,
    deviation,
    of_recovery,
    of_recovery_time,
    recovery_s,
)
from tests.reproduced import as_published

FAST = ("2.2", "2.3", "2.1fig", "2.3fig", "claims")
LEFT_OUT = ("P14", "P15", "P16", "P23", "P24", "P37", "P38")
SHORT = Scenario(((3, 1.0),), num_platoons=3, duration_s=20.0)


def test_readings_that_were_tried_are_judged_as_their_claims_are() -> None:
    """With made-up outcomes: collisions at the largest lag only, and 66 of 120 intact vehicles in them."""
    none, seen = np.zeros(200, np.int64), DisbandingEvidence()
    intact = np.repeat([True] * 12 + [False] * 8, 10)
    found: dict[Any, Any] = {}
    for experiment in tried(seen):
        if isinstance(experiment, PlayedScenario):
            found[experiment] = {"collided": 2.0 if experiment.tau_s == 0.5 else 0.0}
        else:
            collided = np.arange(200) < (66 if len(experiment.attack) == 8 else 0)
            found[experiment] = ScenarioOutcome(0.0, 0.0, intact, none, collided, collided)
    seen = DisbandingEvidence(found)
    periods, counts = tried_tables(seen)
    assert {row[-1] for row in periods.rows} == {"reproduced"}
    assert [row[-1] == "reproduced" for row in counts.rows] == [row[0] == "8" for row in counts.rows]
    assert "6 of 30 combinations fit" in counts.notes[0]
    assert len(tried_data(seen)["every_other"]) == 30


@pytest.mark.parametrize(("interpretation", "count"), [("S0", 4), ("S1", 2), ("S2", 2)])
def test_the_heuristic_is_repeated_after_whole_integration_steps(interpretation: str, count: int) -> None:
    seen = DisbandingEvidence().under(interpretation)
    played = [each for each in tried(seen) if isinstance(each, PlayedScenario)]
    assert len({each.config.control_period_s for each in played}) == count


@pytest.mark.parametrize(("count", "share"), [(8, 55.0), (10, 54.0)])
def test_disbanded_platoons_from_the_19th_on(count: int, share: float) -> None:
    outcome = disbanded(DisbandingEvidence(), count, 19, 0.2).run()
    assert outcome.collided_share() == pytest.approx(share, abs=0.05)


@pytest.fixture(scope="module")
def found() -> Reproduction[DisbandingEvidence]:
    return CHAPTER.reproduce(FAST, quick=True)


def test_every_cell_is_within_its_tolerance_of_the_reference(found: Reproduction[DisbandingEvidence]) -> None:
    assert len(found.checks) == 36
    assert [check.label for check in found.checks if not check.passed] == []
    assert [check.label for check in found.checks if not check.subject.crash_agrees] == []
    assert found.passed


def test_verdicts_are_the_published_ones(found: Reproduction[DisbandingEvidence]) -> None:
    document = as_published(found, LEFT_OUT)
    assert list(document["parts"]) == list(FAST)
    assert document["parts"]["2.2"]["mean_absolute_difference"]["baseline"]["intact"] == pytest.approx(1.12, abs=0.01)
    assert document["regression"]["passed"] is True


def test_the_other_averaging_set_fits_the_paper_less(found: Reproduction[DisbandingEvidence]) -> None:
    for table, other in (("2.2", "all"), ("2.3", "intact")):
        cells = table_cells(found.evidence, table, ("baseline",))
        assert mean_distance(cells, other) > mean_distance(cells) + 2.0


@pytest.mark.parametrize("table", ["2.2", "2.3"])
def test_cells_stand_beside_those_of_the_paper(found: Reproduction[DisbandingEvidence], table: str) -> None:
    cells = table_cells(found.evidence, table)
    assert [cell.paper for cell in cells] == velocity_errors(f"table_{table.replace('.', '_')}")
    assert all(cell.difference == cell.ours - cell.paper.velocity_error_percent for cell in cells)


def test_a_matching_cell_does_not_hide_the_effect_of_a_mitigation(found: Reproduction[DisbandingEvidence]) -> None:
    effects = {(cell.table, cell.name): cell.effect for cell in cells_of(found)}
    assert sum(effect is None for effect in effects.values()) == 12
    effect = effects["2.2", "heuristic (5 m, 0.1 s)"]
    assert effect is not None
    assert effect.paper == pytest.approx(24.283 - 29.570)
    assert effect.ours == pytest.approx(25.44 - 29.56, abs=0.01)
    text = " ".join(found.closing())
    assert "2.2 heuristic (5 m, 0.1 s) -4.1 for -5.3" in text
    assert "2.3 heuristic (5 m, 0.1 s) -5.9" not in text  # no match in the first place


def test_reference_covers_the_tables_of_the_specification() -> None:
    known = references()
    assert len(known) == 13 * 6
    assert {key[:3] for key in known} >= {(table, "S0", name) for table in ("2.2", "2.3") for name in CONTROLLERS}


def test_a_number_that_left_the_reference_fails_and_is_named(found: Reproduction[DisbandingEvidence]) -> None:
    experiment = DisbandingEvidence().cell("2.2", "heuristic", 4.0, 0.3)
    results = dict.fromkeys(CHAPTER.needed(("2.2",), found.evidence))
    results = {each: found.evidence[each] for each in results}
    outcome = results[experiment]
    results[experiment] = replace(outcome, velocity_error_intact=outcome.velocity_error_intact + 0.2)
    changed = Reproduction(CHAPTER, ("2.2",), DisbandingEvidence(results))
    assert not changed.passed
    assert any("FAILED: 2.2 heuristic (4 m, 0.3 s) off by +0.196" in paragraph for paragraph in changed.closing())


def test_values_of_the_claims(found: Reproduction[DisbandingEvidence]) -> None:
    values = {claim.id: finding.value for claim, finding in found.findings[""]}
    expected = {"P05": 1.08, "P06": 14.2, "P07": 89, "P13": 10.35, "P17": 75, "P18": 29, "P19": 15, "P21": 29.51}
    expected |= {"P22": 44.42, "P32": 64, "P33": 0, "P34": 55.6}
    for name, value in expected.items():
        assert values[name] == pytest.approx(value, abs=0.05 if value < 20 else 0.5), name


def test_a_claim_that_drops_cells_says_how_many(found: Reproduction[DisbandingEvidence]) -> None:
    shown = {claim.id: finding.shown for claim, finding in found.findings[""]}
    assert shown["P27"].endswith("4 of 5 tau apply")


def test_errors_grow_with_the_string_as_in_the_specification(found: Reproduction[DisbandingEvidence]) -> None:
    expected = {
        0.1: (18.86, 19.46, 20.60, 21.97, 23.48, 25.07, 26.69, 28.17, 29.56),
        0.3: (20.86, 23.25, 26.16, 28.90, 31.09, 32.96, 34.64, 36.20, 37.68),
        0.5: (23.36, 27.64, 32.08, 35.72, 39.03, 42.19, 45.25, 48.26, 51.28),
    }
    for tau_s, row in expected.items():
        outcomes = [found.evidence[DisbandingEvidence().single(count, tau_s)] for count in range(2, 11)]
        np.testing.assert_allclose([outcome.velocity_error_intact for outcome in outcomes], row, atol=0.05)
    collided = [int(found.evidence[DisbandingEvidence().single(count, 0.2)].collided.sum()) for count in range(2, 11)]
    assert collided == [6 * (count - 1) for count in range(2, 11)]


def test_closing_names_what_is_missed(found: Reproduction[DisbandingEvidence]) -> None:
    text = " ".join(found.closing())
    for cell in cells_of(found):
        assert (f"{cell.table} {cell.name} {cell.difference:+.1f}" in text) == (cell.verdict == "miss")
    for words in ("tuned on the mpc column", "36 of 36 cells within", "not reproduced: P08", "--quick left out"):
        assert words in text


def test_figures_have_the_paper_s_panels_with_units(found: Reproduction[DisbandingEvidence]) -> None:
    pytest.importorskip("matplotlib")
    for draw, panels in ((plots.draw_2_1, "abcde"), (plots.draw_2_3, "abcd")):
        axes = draw(found.evidence).axes
        assert "".join(each.get_title(loc="left")[0] for each in axes) == panels
        assert all(each.get_xlabel() and each.get_ylabel() and each.lines for each in axes)


def test_recording_does_not_change_the_outcome() -> None:
    plain, recorded = SHORT.run(), Recorded(**vars(SHORT)).run()
    assert recorded.velocity_error_all == plain.velocity_error_all
    assert recorded.position_m.shape == (101, 30)
    assert recorded.time_s[-1] == pytest.approx(SHORT.duration_s)


def test_without_an_attack_everything_keeps_what_it_begins_with() -> None:
    record = Recorded(**vars(replace(SHORT, attack=())), sample_s=1.0).run()
    assert np.abs(record.speed_mps - record.speed_mps[0]).max() < 1e-9
    assert np.abs(np.diff(record.position_m, axis=1) - np.diff(record.position_m[0])).max() < 1e-9
    assert record.recovered_s() == record.settled_s(1) == 0.0


def test_recovery_is_for_good_and_by_both_shares() -> None:
    time_s = np.arange(6.0)
    deviations = np.array([0.0, 0.2, 0.04, 0.09, 0.04, 0.01])
    assert (recovery_s(time_s, deviations), recovery_s(time_s, deviations, NEAR_SHARE)) == (4.0, 2.0)
    assert recovery_s(time_s, deviations[::-1] + 0.06) is None
    assert recovery_s(time_s, 0.0 * deviations) == 0.0
    assert deviation(np.array([[11.0, 5.0]]), np.array([10.0, 5.1]), np.array([10.0, 1.0])) == pytest.approx([0.1])
    assert deviation(np.ones((2, 3, 4)), np.zeros(4), 1.0).shape == (2, 3)
    assert [of_recovery_time(same, 60.0, 60.0) for same in (62.0, 65.0, 89.0, None)] == [
        REPRODUCED,
        NEAR,
        PARTLY,
        PARTLY,
    ]
    assert of_recovery_time(None, None, 60.0) == NOT
    assert of_recovery([True, True], [True, True]) == REPRODUCED
    assert of_recovery([False, False], [True, False]) == of_recovery([True, False], [True, True]) == PARTLY
    assert of_recovery([False, False], [False, False]) == NOT


def test_search_evaluates_plans_like_scenarios() -> None:
    plans = np.full((2, 10), np.inf)
    plans[0, 9], plans[1, [9, 8]] = 1.0, [2.0, 100.0]
    values = evaluator(Scenario(()))(plans)
    expected = [
        DisbandingEvidence().cell(table, "baseline", 5.0, 0.1).run().velocity_error_all for table in ("2.2", "2.3")
    ]
    np.testing.assert_array_equal(values, expected)


def test_what_is_played_is_what_is_simulated() -> None:
    """Without a defence the environment and the scenario of Figs. 2.3c and d are one simulation."""
    for count, tau_s in ((2, 0.3), (4, 0.5)):
        played = DisbandingEvidence().defended(count, tau_s, "none").run()
        outcome = DisbandingEvidence().single(count, tau_s).run()
        assert played["velocity_error_intact"] == outcome.velocity_error_intact
        assert played["collided"] == outcome.collided.sum()


def test_every_reading_differs_from_the_paper_s_and_is_played_as_it_says() -> None:
    experiments = DisbandingEvidence(interpretation="S1")
    configs = [experiments.reading(each, 0.3, "none").config for each in READINGS]
    assert len({repr(config) for config in configs}) == len(READINGS) == len({each.name for each in READINGS})
    assert {config.interpretation for config in configs} == {"S1"}
    assert {config.report for config in configs} == {"full"}
    assert configs[0] == replace(PAPER, tau_s=0.3, interpretation="S1", report="full")


def test_the_rear_vehicle_s_sensor_is_the_milder_attack() -> None:
    """Its alert runs from the rear to the front, the leader's the other way; in `paper` all take over at once."""
    names = ("preset paper", "leader's sensor, 0.5 s per link", "rear vehicle's sensor, 0.5 s per link")
    readings = {each.name: each for each in READINGS}
    found = [DisbandingEvidence().reading(readings[name], 0.3, "none").run()["velocity_error_intact"] for name in names]
    assert found[2] + 5.0 < found[0] < found[1]


def test_what_is_played_fills_its_tables() -> None:
    """With made-up metrics, so that every number stands where it belongs."""
    todo = CHAPTER.needed(("platoons", "text"), DisbandingEvidence())
    metrics = ("velocity_error_intact", "collided_intact", "acceleration_mps2", "jerk_mps3", "energy_kj_per_km")
    results = {each: dict.fromkeys((*metrics, "recovery_s"), float(k)) for k, each in enumerate(todo)}
    made = Reproduction(CHAPTER, ("platoons", "text"), DisbandingEvidence(results))
    tables = made.tables()
    where = list(results).index(DisbandingEvidence().defended(7, 0.3, "mpc"))
    assert tables[1].rows[5][0] == "7"
    assert tables[1].rows[5][3] == f"{where:.2f} ({where})"
    where = list(results).index(DisbandingEvidence().reading(READINGS[2], 0.5, "copy"))
    assert tables[6].rows[2] == ("standstill rule (r_0)", *tables[6].rows[2][1:3], f"{where:.2f} ({where})")
    document = json.loads(to_json(made.document()))["parts"]
    assert len(document["platoons"]) + len(document["text"]) == len(results)
    assert made.closing() == []


@pytest.fixture(scope="module")
def everything() -> Reproduction[DisbandingEvidence]:
    return CHAPTER.reproduce(jobs=2, all_interpretations=True)


@pytest.mark.slow
def test_full_run_leaves_no_claim_open(everything: Reproduction[DisbandingEvidence]) -> None:
    as_published(everything)
    assert everything.passed


@pytest.mark.slow
def test_genetic_algorithm_finds_the_lead_platoon_at_the_first_instant(
    everything: Reproduction[DisbandingEvidence],
) -> None:
    rows = json.loads(to_json(everything.document()["parts"]["ga"]))
    single = [row for row in rows if row["budget"] == 1]
    assert [(row["tau_s"], row["found"]) for row in single] == [(tau_s, [[10, 1.0]]) for tau_s in (0.1, 0.3, 0.5)]
    double = next(row for row in rows if row["budget"] == 2 and row["tau_s"] == 0.1)
    assert [platoon for platoon, _ in double["found"]] == [10, 9]
    assert double["velocity_error_all"] >= double["paper_plan_error"]


@pytest.mark.slow
def test_interpretations_decide_the_crash_flags(everything: Reproduction[DisbandingEvidence]) -> None:
    documents = everything.document()["interpretations"]
    verdicts = {name: tuple(row["verdict"] for row in document["claims"]) for name, document in documents.items()}
    assert verdicts == {"S0": (NEAR, PARTLY), "S1": (REPRODUCED, NEAR), "S2": (NEAR, REPRODUCED)}


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["heuristic", "mpc"])
def test_a_policy_at_every_step_does_not_take_the_place_of_the_closed_loop(controller: str) -> None:
    built_in = Scenario(((10, 1.0),), controller=controller).run()
    played = PlayedScenario(controller, overrides=(("control_period_s", 0.01),)).run()
    assert abs(played["velocity_error_intact"] - built_in.velocity_error_intact) > 0.05


def test_products_are_counted_from_the_sizes_of_the_programs() -> None:
    horizon, program = PAPER_MATCHING.horizon, design_mpc(PAPER_MATCHING, 0.1)
    rows = len(program.qp.rows)
    least, most = mpc_products(horizon)
    assert rows == 5 * horizon - 4
    assert least == 63 + horizon**2 + rows * horizon  # 35 + 12 + 16 for the terms
    assert most == least + 60 * rows * (rows + 1) + rows * horizon
    assert heuristic_products(FORESIGHT, -5.0, 1.0) == (20, 25 + 61 * 17)  # 61 commands, 0.1 m/s2 apart
