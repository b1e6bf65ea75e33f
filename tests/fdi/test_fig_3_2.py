"""Fig. 3.2: runs of Algorithm 2 against their deterministic values and against a loop that shares no code with them."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_paper.fdi import figure_3_2
from cps_paper.fdi.course import attack_course
from cps_paper.fdi.figure_3_2 import (
    FAR,
    ROUGH,
    FigureRow,
    figure_runs,
    main_rows,
)
from cps_paper.fdi.interpretations import FIG_3_2

Anchor = tuple[float, float, int] | None  # time in s, e_v in m/s, pair
ANCHORS: dict[tuple[str, str], Anchor] = {
    ("fig32", "x"): (30.45, -3.89, 10),
    ("fig32", "xv"): (12.45, -5.05, 10),
    ("k_d 5", "x"): (30.95, -3.21, 10),
    ("k_d 5", "xv"): (12.10, -7.55, 10),
    ("k_p 1", "x"): (34.0, -5.11, 10),
    ("k_p 1", "xv"): (12.4, -3.30, 10),
    ("9-10 only", "x"): (39.60, -0.24, 9),
    ("9-10 only", "xv"): (21.10, -4.13, 9),
    ("+e_x", "x"): (4.30, -1.69, 9),
    ("+e_x", "xv"): (3.55, -5.16, 9),
    ("bounded", "x"): None,
    ("bounded", "xv"): (12.75, -4.09, 10),
}


@pytest.fixture(scope="module")
def rows() -> list[FigureRow]:
    return [FigureRow(run, run.run()) for run in figure_runs()]


def of(rows: list[FigureRow], name: str, kind: str) -> FigureRow:
    (row,) = (row for row in rows if (row.run.variant.name, row.run.kind) == (name, kind))
    return row


def test_there_is_an_anchor_for_every_run(rows: list[FigureRow]) -> None:
    assert {(row.run.variant.name, row.run.kind) for row in rows} == set(ANCHORS)


@pytest.mark.parametrize(("name", "kind"), ANCHORS)
def test_anchor(rows: list[FigureRow], name: str, kind: str) -> None:
    row, anchor = of(rows, name, kind), ANCHORS[name, kind]
    if anchor is None:
        assert row.collision is None
        assert row.course.time_s[-1] == pytest.approx(60.0)
        return
    time_s, speed_mps, pair = anchor
    assert row.collision is not None
    assert row.collision.pair == pair
    assert row.collision.time_s == pytest.approx(time_s, abs=1.01 * row.course.dt_s)
    assert row.collision.impact_speed_mps == pytest.approx(speed_mps, abs=0.01)


def independent(config: FdiConfig, kind: str, sign: float = -1.0) -> tuple[int, FloatArray, FloatArray]:
    """Euler's method on the vehicles themselves, attack by the closed form: steps, gap errors and relative speeds."""
    n, dt, k_p, k_d = config.num_vehicles, config.dt_s, config.proportional_gain, config.derivative_gain
    position, speed = -5.0 * np.arange(n, -1, -1.0), np.full(n + 1, 30.0)  # the last one is the reference
    gain = {"x": len(kind) * k_p, "v": len(kind) * k_d}
    for step in range(1200):
        e_x, e_v = np.diff(position) - 5.0, np.diff(speed)
        if (e_x <= -5.0 + 1e-7).any():
            return step, e_x, e_v
        shown_x, shown_v = e_x.copy(), e_v.copy()
        ahead = k_p * e_x + k_d * e_v
        rest = ahead[-1] - ahead[-2] + sign * e_x[-1]
        for sensor, resolution, shown in (("x", 0.5, shown_x), ("v", 0.25, shown_v)):
            if sensor in kind:
                edge = -rest / gain[sensor] / resolution
                if e_v[-1] < 0:
                    level = max(0, int(np.ceil(edge - 1e-9)))
                elif e_v[-1] > 0:
                    level = min(0, int(np.floor(edge + 1e-9)))
                else:
                    level = min(0, int(np.ceil(edge - 1e-9)) - 1)
                shown[-1] += level * resolution
        u = k_p * shown_x + k_d * shown_v
        u[1:] -= ahead[:-1]  # rear sensors are never attacked
        position = position + dt * speed
        speed = speed + dt * np.append(u, 0.0)
    return 1200, e_x, e_v


@pytest.mark.parametrize("kind", ["x", "xv"])
def test_an_independent_simulation_agrees(rows: list[FigureRow], kind: str) -> None:
    course = of(rows, "fig32", kind).course
    steps, e_x, e_v = independent(FIG_3_2, kind)
    assert steps == len(course.injection)
    np.testing.assert_allclose(course.gap_m[-1], e_x + 5.0, atol=1e-6)
    np.testing.assert_allclose(course.relative_speed_mps[-1], e_v, atol=1e-6)


def test_the_printed_direction_does_not_destabilise() -> None:
    """Errata 3: with h_2 <= 0 as in line 8 of Algorithm 2 the platoon moves, and nobody collides in 60 s."""
    model, e, largest_m = FIG_3_2.model, np.zeros(20), 0.0
    candidates = np.array(sorted(np.arange(-100, 101) * 0.5, key=lambda d: (abs(d), d)))
    for _ in range(1200):
        rest = (model.feedback @ e)[9] - e[9]
        with np.errstate(all="ignore"):
            accepted = candidates[-(2.0 * candidates + rest) / e[19] <= 0.0]
        e = model.transition @ e + model.injection[:, 9] * (accepted[0] if len(accepted) else 0.0)
        largest_m = max(largest_m, np.abs(e[:10]).max())
    assert 0.1 < largest_m < 5.0


def test_relation_to_the_paper(rows: list[FigureRow]) -> None:
    for row in main_rows(rows):
        assert row.time_difference == pytest.approx(0.0, abs=0.09)
        assert row.speed_difference == pytest.approx(0.0, abs=0.16)
        assert not row.pair_agrees
        assert row.verdict == ROUGH
    assert of(rows, "bounded", "x").verdict == FAR
    assert of(rows, "+e_x", "xv").verdict == FAR
    assert of(rows, "9-10 only", "xv").pair_agrees


def test_only_impossible_readings_start_the_range_attack(rows: list[FigureRow]) -> None:
    assert min(of(rows, "fig32", "x").course.injection[:, 0]) == -11.0
    assert (of(rows, "fig32", "x").course.lowest_reading_m or 0.0) < -5.0
    assert (of(rows, "bounded", "x").course.lowest_reading_m or 0.0) >= 0.0
    assert of(rows, "bounded", "x").course.infeasible_calls > 0


def test_courses_end_at_the_first_watched_collision() -> None:
    everything = attack_course(FIG_3_2, "xv")
    spared = attack_course(FIG_3_2, "xv", ignored_pair=10)
    assert (everything.gap_m[:-1] > 0.0).all()
    assert (everything.gap_m[-1] <= 1e-6).any()
    assert len(spared.gap_m) > len(everything.gap_m)
    np.testing.assert_array_equal(spared.gap_m[: len(everything.gap_m)], everything.gap_m)
    assert attack_course(FIG_3_2, "v").lowest_reading_m is None


def test_figure_has_four_panels_with_units(rows: list[FigureRow]) -> None:
    pytest.importorskip("matplotlib")
    axes = figure_3_2.draw_figure(main_rows(rows)).axes
    assert [each.get_title(loc="left")[0] for each in axes] == ["a", "b", "c", "d"]
    assert all(each.get_xlabel() and each.get_ylabel() and len(each.lines) >= 10 for each in axes)
