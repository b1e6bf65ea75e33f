from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.picture.bars import draw_bar
from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.frame import draw_cards, draw_event, draw_header
from cps_envs.core.picture.palette import WHITE, tint
from cps_envs.core.picture.pixels import PixelCanvas
from cps_envs.core.picture.plot import ROOM, Plot, draw_curve, draw_dots, draw_panel, rounded_up

pytest.importorskip("pygame")

PLOT = Plot((10.0, 10.0, 80.0, 40.0), -5.0, 15.0)
INK = (20, 40, 60)


def blank() -> Canvas:
    canvas = PixelCanvas(100, 60)
    canvas.fill(WHITE)
    return canvas


def test_ends_of_the_range_lie_inside_the_panel_and_others_at_the_nearest_end() -> None:
    assert PLOT.y(15.0) == PLOT.y(99.0) == 10.0 + ROOM
    assert PLOT.y(-5.0) == PLOT.y(-99.0) == 50.0 - ROOM
    assert PLOT.y(5.0) == 30.0
    x = np.array([1.0, 2.0, 3.0])
    assert PLOT.points(x, np.array([99.0, 5.0, -5.0])) == [(1.0, 14.0), (2.0, 30.0), (3.0, 46.0)]


def test_range_and_width() -> None:
    assert [PLOT.shows(value) for value in (-5.1, -5.0, 15.0, 15.1)] == [False, True, True, False]
    assert PLOT.along(np.array([0.0, 0.5, 1.0, 2.0])).tolist() == [14.0, 50.0, 86.0, 86.0]


@pytest.mark.parametrize(("value", "expected"), [(1.0, 1.0), (1.01, 1.5), (0.034, 0.05), (71.0, 100.0), (7e3, 7e3)])
def test_axes_end_at_round_numbers(value: float, expected: float) -> None:
    assert rounded_up(value) == pytest.approx(expected)


@pytest.mark.parametrize(("low", "high"), [(-5.0, 15.0), (0.0, 1.6), (-4.5, 18.0), (0.0, 1e4)])
def test_marks_are_few_equally_spaced_and_in_range(low: float, high: float) -> None:
    marks = Plot((10.0, 10.0, 80.0, 64.0), low, high).marks()
    assert 2 <= len(marks) <= 6
    assert low - 1e-9 <= min(marks) <= max(marks) <= high + 1e-9
    np.testing.assert_allclose(np.diff(marks), marks[1] - marks[0])


def test_low_panels_have_fewer_marks() -> None:
    counts = [len(Plot((10.0, 10.0, 80.0, height), 0.0, 10.0).marks()) for height in (10.0, 32.0, 64.0, 500.0)]
    assert counts == [2, 3, 3, 3]


def test_a_logarithmic_panel() -> None:
    plot = Plot((10.0, 10.0, 80.0, 64.0), -2.0, 4.0, logarithmic=True)
    assert plot.marks() == [1e-2, 1.0, 1e2, 1e4]
    assert (plot.y(1e-2), plot.y(0.0), plot.y(10.0), plot.y(1e6)) == (70.0, 70.0, 42.0, 14.0)
    assert [plot.shows(value) for value in (0.0, 0.009, 0.01, 1e4, 1.1e4)] == [False, False, True, True, False]
    canvas = PixelCanvas(140, 90)
    canvas.fill(WHITE)
    draw_panel(canvas, plot)
    draw_dots(canvas, plot.points(np.array([20.0, 40.0]), np.array([10.0, 1e4])), INK)
    assert [tuple(canvas.pixels()[y, x]) for x, y in ((20, 42), (40, 14))] == [INK, INK]


@pytest.mark.parametrize(("value", "top", "bottom"), [(15.0, 14, 38), (-5.0, 38, 46), (0.0, 38, 40)])
def test_bars_reach_from_zero_to_their_value(value: float, top: int, bottom: int) -> None:
    canvas = blank()
    draw_bar(canvas, PLOT, 40.0, value, INK, 10.0)
    rows, columns = np.nonzero((canvas.pixels() != WHITE).any(axis=2))
    assert (columns.min(), columns.max() + 1) == (40, 50)
    assert (rows.min(), rows.max() + 1) == (top, bottom)


def test_a_bar_that_leaves_the_panel_has_a_tip() -> None:
    within, beyond = blank(), blank()
    draw_bar(within, PLOT, 40.0, 15.0, INK, 4.0)
    draw_bar(beyond, PLOT, 40.0, 15.1, INK, 4.0)
    assert (beyond.pixels() != WHITE).sum() > (within.pixels() != WHITE).sum()


def test_a_curve_needs_two_points() -> None:
    canvas = blank()
    draw_curve(canvas, [(20.0, 20.0)], INK)
    assert (canvas.pixels() == WHITE).all()
    draw_curve(canvas, [(20.0, 20.0), (40.0, 20.0)], INK)
    assert not (canvas.pixels() == WHITE).all()


def test_a_long_subtitle_leaves_the_time_alone() -> None:
    pictures = []
    for subtitle in ("short", "very long " * 30):
        canvas = PixelCanvas(960, 540)
        canvas.fill(WHITE)
        draw_header(canvas, "Title", subtitle, 12.5, 100.0)
        pictures.append(canvas.pixels())
    assert np.array_equal(pictures[0][:, 850:], pictures[1][:, 850:])
    assert not np.array_equal(*pictures)


def test_events_and_cards_are_drawn_where_they_belong() -> None:
    canvas = PixelCanvas(960, 540)
    canvas.fill(WHITE)
    draw_event(canvas, 0.5, INK)
    columns = np.nonzero((canvas.pixels() != WHITE).any(axis=2))[1]
    assert abs(columns.mean() - 479.5) < 1
    draw_cards(canvas, [("Label", "1.0"), ("Other", "2.0")], (16.0, 52.0, 500.0, 38.0), 100.0)
    cards = (canvas.pixels()[52:90] != WHITE).any(axis=(0, 2))
    assert cards[16:108].all()
    assert not cards[108:116].any()
    assert cards[116:208].all()
    assert not cards[208:].any()


def test_tint_lies_between_the_ground_and_the_colour() -> None:
    assert tint(INK, 1.0) == INK
    assert tint(INK, 0.0) == WHITE
    assert tint((100, 0, 200), 0.5, (0, 100, 100)) == (50, 50, 150)
