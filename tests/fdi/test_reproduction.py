"""`reproduce ch3` as a library: verdicts and counts by their rules, controls, regression, and real solves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import make_task
from cps_paper.chapter import Reproduction
from cps_paper.fdi.audit import beyond_set_a
from cps_paper.fdi.cells import CollisionPair, table_cells
from cps_paper.fdi.chapter import CHAPTER
from cps_paper.fdi.continuous import compare, compared, verdict
from cps_paper.fdi.controls import control_tables
from cps_paper.fdi.counts import ALLOWANCE, REFERENCE, Counts, count_tables, counted
from cps_paper.fdi.experiments import (
    ALL_FOUR,
    FOUR_VEHICLES,
    ONE_HORIZON,
    RELAXED,
    CircleRun,
    FdiEvidence,
    RelaxedSpeeds,
)
from cps_paper.fdi.grid import GridEnd
from cps_paper.fdi.more_sensors import compared_sensors
from cps_paper.printed.tables import CollisionCell, collision_cells
from cps_paper.verdicts import MATCH, MISS, NEAR, NOT, OPEN, PARTLY
from tests.reproduced import as_published

TASK = make_task("x3", 4, 4)
PAPER = CollisionCell("3.1", TASK, ((3, -1.848), (4, -2.003)))
NOTHING = CollisionCell("3.1", TASK, ())


def cell(
    paper: CollisionCell,
    hit: bool | None,
    value: float | None = None,
    bound: float = 0.0,
    *,
    pairs: tuple[int, ...] = (),
) -> CollisionPair:
    record = Record(TASK, bound, value, bound, PROVED, 0.0)
    found = CollisionPair(paper, A, GridEnd(TASK, hit, None, None), record)
    return found if not pairs else WithPairs(paper, A, GridEnd(TASK, hit, None, None), record, pairs)


@dataclass(frozen=True)
class WithPairs(CollisionPair):
    """A cell whose colliding pairs are given."""

    given: tuple[int, ...] = ()

    @property
    def pairs(self) -> tuple[int, ...]:
        return self.given


@pytest.fixture(scope="module")
def found() -> Reproduction[FdiEvidence]:
    return CHAPTER.reproduce(("3.1", "fig", "audit"), quick=True)


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        (cell(PAPER, True, 2.1, 2.1, pairs=(3, 4)), MATCH),
        (cell(PAPER, True, 2.3, 2.3, pairs=(3, 4)), NEAR),
        (cell(PAPER, True, 2.1, 2.1, pairs=(4,)), NEAR),
        (cell(PAPER, True, 1.5, 2.5, pairs=(3, 4)), OPEN),  # the gap decides
        (cell(PAPER, True, 2.1, 2.5, pairs=(3, 4)), OPEN),
        (cell(PAPER, False), MISS),
        (cell(NOTHING, True, 2.0, 2.0, pairs=(4,)), MISS),
        (cell(NOTHING, False), MATCH),
        (cell(NOTHING, None, None, 2.0), OPEN),
        (cell(PAPER, None, None, 2.0), OPEN),
    ],
)
def test_rules_of_a_cell(found: CollisionPair, verdict: str) -> None:
    assert found.verdict == verdict


def test_counts_and_their_total() -> None:
    every = [cell(PAPER, True, 2.0, 2.0, pairs=(4,)), cell(NOTHING, False), cell(PAPER, None)]
    counts = count_tables(dict.fromkeys(FOUR_VEHICLES, every), None)
    assert [each.table for each in counts] == [*FOUR_VEHICLES, ALL_FOUR]
    assert counts[0].counts == Counts(2, 1, 0, 0, 1)
    assert counts[-1].counts == Counts(12, 6, 0, 0, 6)


def test_a_count_that_leaves_its_reference_fails() -> None:
    cells = {"3.1": [cell(NOTHING, False)] * 10}
    for goal, passed in ((10 + ALLOWANCE, True), (11 + ALLOWANCE, False)):
        (counts,) = count_tables(cells, {"3.1": Counts(goal, 0, 0, 0, 0)})
        assert counts.passed is passed


def test_references_are_consistent() -> None:
    for found in REFERENCE.values():
        every = [found[table] for table in FOUR_VEHICLES]
        assert tuple(map(sum, zip(*every, strict=True))) == found[ALL_FOUR]


def test_two_sensors_are_compared_with_one() -> None:
    assert [each.verdict for each in compared_sensors()] == [PARTLY, PARTLY]
    assert all(each.gained >= each.larger for each in compared_sensors())


def test_every_solve_reproduces_its_cell(found: Reproduction[FdiEvidence]) -> None:
    cells = table_cells(found.evidence, "3.1")
    assert [cell.paper for cell in cells] == collision_cells("3.1")
    assert [cell.ours.task for cell in cells] == [cell.paper.task for cell in cells]
    (counts,) = counted(found.evidence)
    assert counts.counts.feasibility == 13
    assert counts.passed
    assert found.passed


def test_verdicts_are_the_published_ones(found: Reproduction[FdiEvidence]) -> None:
    document = as_published(found)
    assert list(document["parts"]) == ["3.1", "fig", "audit"]
    assert len(document["parts"]["audit"]["contradictions"]) == 75
    assert document["counts"][0]["reference"]["feasibility"] == 13
    assert document["settings"] == {"parameters": "A", "nodes": 100, "acceptance": 0.45}


def test_relaxed_control_has_the_numbers_of_the_specification(found: Reproduction[FdiEvidence]) -> None:
    speeds = found.evidence[RelaxedSpeeds(RELAXED)]
    expected = {"3.1": 16, "3.2": 15, "3.5": 15, "3.3": 22, "3.4": 23, "3.6": 16}
    for table, count in expected.items():
        cells = collision_cells(table)
        assert sum(((speeds[cell.task] or 0.0) >= 1.75) == cell.feasible for cell in cells) == count
    (controls,) = control_tables(found.evidence, ["3.1"])
    assert controls.relaxed == 16
    assert (controls.any_attack, controls.fast_attack) == (14, 15)


def test_speeds_beyond_set_a(found: Reproduction[FdiEvidence]) -> None:
    beyond = list(beyond_set_a(found.evidence))
    assert len(beyond) == 27
    speeds = found.evidence[RelaxedSpeeds(ONE_HORIZON)]
    assert sum(speed is not None for speed in speeds.values()) == 88
    assert speeds[make_task("x4", 4, 4)] == pytest.approx(6.8159, abs=1e-3)
    for cell, fastest in beyond:
        assert fastest is None or -(cell.target_speed_mps or 0.0) > fastest


def test_closing_says_what_is_not_reproducible(found: Reproduction[FdiEvidence]) -> None:
    text = " ".join(found.closing())
    for words in (
        "Not reproducible: the individual speeds",
        "Not reproducible: the constants",
        "by construction",
        "at higher speeds: partly. The shipped optima have them: preset paper: 88 of 120 tasks reached, against 8",
        "75 of 133",
        "order of magnitude reproduced, not confirmed",
        "Not reproducible: the collision of vehicles 9 and 10",
        "--quick left out",
    ):
        assert words in text


def test_continuous_injections_are_compared_on_what_is_known() -> None:
    def record(lp: float | None, value: float | None, bound: float, status: str) -> Record:
        return Record(TASK, lp, value, bound, status, 0.0)

    faster = [record(4.4, 4.0, 4.0, PROVED), record(2.0, 2.0, 2.0, PROVED), record(3.0, 2.0, 2.9, TIME_LIMIT)]
    lost = [record(1.0, None, 0.0, INFEASIBLE), record(1.0, None, 0.9, TIME_LIMIT), record(None, None, 0.0, INFEASIBLE)]
    found = compare("made", [*faster, *lost])
    assert (found.tasks, found.reached, found.known, found.unreachable, found.unsettled) == (6, 5, 3, 1, 1)
    assert found.ratios == pytest.approx((1.1, 1.0))
    assert (found.mean_ratio, found.notably_faster) == (pytest.approx(1.05), 1)
    assert verdict([found]) == PARTLY
    assert verdict([found, compare("made", faster)]) == verdict([compare("made", [faster[1], *lost])]) == NOT


def test_shipped_optima_have_continuous_injections_ahead() -> None:
    for found in compared():
        assert found.reached == found.known + found.unreachable + found.unsettled
        assert found.reaches_more
        assert found.faster
        assert min(found.ratios) >= 1.0


def test_what_the_parts_need() -> None:
    everything: list[Any] = CHAPTER.needed(CHAPTER.chosen(), FdiEvidence())
    assert sum(isinstance(each, CircleRun) for each in everything) == 340  # half of them at fitted horizons
    quick: list[Any] = CHAPTER.needed(CHAPTER.chosen(quick=True), FdiEvidence(quick=True))
    assert not any(isinstance(each, CircleRun) and each.fitted for each in quick)
    assert all(each.cost > 0 and each.label for each in everything)
