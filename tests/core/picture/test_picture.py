"""What pictures are made of: canvas, panels and plots, their history, vehicles."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.frame import CARDS, Frame, LegendEntry
from cps_envs.core.picture.gauge import Gauge
from cps_envs.core.picture.history import History
from cps_envs.core.picture.marks import Area, Bar, Dots, Event, LevelLine, Line, Mark
from cps_envs.core.picture.palette import MUTED, PAGE, WHITE, color_scale, darker, tint
from cps_envs.core.picture.panel import Panel, side_by_side
from cps_envs.core.picture.pixels import PixelCanvas
from cps_envs.core.picture.plot import ROOM, Plot, rounded_up
from cps_envs.core.picture.vehicle import ASPHALT, draw_burst, draw_car, draw_ghost
from cps_envs.core.types import Array, FloatArray

pytest.importorskip("pygame")

INK = (20, 40, 60)
PAPER = (60, 40)
PLOT = Plot((10.0, 10.0, 80.0, 40.0), -5.0, 15.0)
RED, BLUE = (200, 30, 40), (40, 60, 200)
SIZE, AT = (40, 16), (10.0, 12.0)


def blank() -> Canvas:
    canvas = PixelCanvas(*PAPER)
    canvas.fill(WHITE)
    return canvas


def covered(canvas: Canvas) -> FloatArray:
    """How much of each pixel (H, W) is INK, from 0 to 1; all channels agree."""
    shares = (255.0 - canvas.pixels()) / (255.0 - np.array(INK))
    np.testing.assert_allclose(shares, shares[..., :1].repeat(3, axis=2), atol=0.01)
    share: FloatArray = shares.mean(axis=2)
    return share


@pytest.mark.parametrize("center", [(30.0, 20.0), (30.5, 20.5), (29.8, 19.3)])
@pytest.mark.parametrize("radius", [1.5, 4.0, 15.25])
def test_circle_has_its_area_and_centre_to_a_fraction_of_a_pixel(center: Point, radius: float) -> None:
    canvas = blank()
    canvas.circle(center, radius, INK)
    share = covered(canvas)
    assert share.sum() == pytest.approx(np.pi * (radius**2 + 1 / 12), rel=0.02)  # of an edge that fades over a pixel
    middles = [(share.sum(axis=axis) * (np.arange(size) + 0.5)).sum() / share.sum() for axis, size in enumerate(PAPER)]
    np.testing.assert_allclose(middles, center, atol=0.05)
    assert ((share > 0.1) & (share < 0.9)).sum() > 2 * radius


@pytest.mark.parametrize(("end", "thickness"), [((50.0, 10.0), 3.0), ((10.0, 35.0), 5.0), ((48.5, 33.2), 2.5)])
def test_line_has_its_length_and_thickness(end: Point, thickness: float) -> None:
    canvas = blank()
    canvas.line((10.0, 10.0), end, INK, thickness)
    length = float(np.hypot(end[0] - 10.0, end[1] - 10.0))
    assert covered(canvas).sum() == pytest.approx(length * thickness + np.pi * thickness**2 / 4, rel=0.03)


def test_a_line_along_pixels_is_as_sharp_as_a_box() -> None:
    drawn, boxed = blank(), blank()
    drawn.line((10.0, 20.0), (50.0, 20.0), INK, 4.0)
    boxed.box((10, 18, 40, 4), INK)
    assert np.array_equal(drawn.pixels()[:, 12:48], boxed.pixels()[:, 12:48])


def test_circles_and_lines_stay_inside_the_picture_and_a_box() -> None:
    canvas = blank()
    canvas.circle((-50.0, 20.0), 10.0, INK)
    canvas.line((200.0, 0.0), (300.0, 40.0), INK, 3.0)
    assert not covered(canvas).any()
    with canvas.within((0, 0, 30, 40)):
        canvas.circle((30.0, 20.0), 10.0, INK)
    share = covered(canvas)
    assert not share[:, 30:].any()
    assert share.sum() == pytest.approx(50.0 * np.pi, rel=0.03)


def test_sprites_hold_circles() -> None:
    canvas = blank()
    canvas.sprite("disc", (12, 12), (10, 10), lambda large: large.circle((24, 24), 20, INK))
    pixels = canvas.pixels()
    assert tuple(pixels[16, 16]) == INK
    assert tuple(pixels[10, 10]) == WHITE


def test_a_scale_runs_through_its_anchors() -> None:
    scale = color_scale([(0, 0, 0), (100, 50, 0), (200, 50, 40)], (0.0, 0.25, 1.0), 5)
    assert scale == [(0, 0, 0), (100, 50, 0), (133, 50, 13), (167, 50, 27), (200, 50, 40)]


def test_darker_colours() -> None:
    assert darker(PAGE, 0.5) == (123, 123, 124)


def panel() -> Canvas:
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
    share = (np.array([20.0, 40.0]) - 14.0) / 72.0
    Panel(plot, "", [Dots(share, np.array([10.0, 1e4]), INK)]).draw(canvas)
    assert [tuple(canvas.pixels()[y, x]) for x, y in ((20, 42), (40, 14))] == [INK, INK]


@pytest.mark.parametrize(("value", "top", "bottom"), [(15.0, 14, 38), (-5.0, 38, 46), (0.0, 38, 40)])
def test_bars_reach_from_zero_to_their_value(value: float, top: int, bottom: int) -> None:
    canvas = panel()
    Bar(40.0, 10.0, value, INK)(canvas, PLOT)
    rows, columns = np.nonzero((canvas.pixels() != WHITE).any(axis=2))
    assert (columns.min(), columns.max() + 1) == (40, 50)
    assert (rows.min(), rows.max() + 1) == (top, bottom)


def test_a_bar_that_leaves_the_panel_has_a_tip() -> None:
    within, beyond = panel(), panel()
    Bar(40.0, 4.0, 15.0, INK)(within, PLOT)
    Bar(40.0, 4.0, 15.1, INK)(beyond, PLOT)
    assert (beyond.pixels() != WHITE).sum() > (within.pixels() != WHITE).sum()


def drawn(marks: list[Mark], **options: Any) -> Array:
    canvas = panel()
    Panel(PLOT, "", marks, **options).draw(canvas)
    return canvas.pixels()


def test_curves_and_areas_need_two_values() -> None:
    share, values = np.array([0.1, 0.9]), np.array([0.0, 10.0])
    for one, two in (
        (Line(share[:1], values[:1], INK), Line(share, values, INK)),
        (Area(share[:1], values[:1], 0.0, INK), Area(share, values, 0.0, INK)),
    ):
        assert np.array_equal(drawn([one]), drawn([]))
        assert not np.array_equal(drawn([two]), drawn([]))


def test_an_area_above_a_level_is_one_above_a_curve_that_is_level() -> None:
    share, high = np.linspace(0.0, 1.0, 9), np.array([1.0, 5.0, 3.0, 9.0, 9.0, 2.0, 4.0, 7.0, 8.0])
    assert np.array_equal(drawn([Area(share, high, 0.0, INK)]), drawn([Area(share, high, np.zeros(9), INK)]))


def test_marks_lie_over_one_another_in_their_order_and_the_grid_over_bands() -> None:
    curve, level = Line(np.array([0.0, 1.0]), np.array([5.0, 5.0]), INK), LevelLine(5.0, MUTED, solid=True)
    assert not np.array_equal(drawn([curve, level]), drawn([level, curve]))
    zero = round(PLOT.y(0.0))
    assert np.array_equal(drawn([], bands=[((20, 10, 20, 40), INK)])[zero, 25], drawn([])[zero, 25])


def test_a_dashed_level_is_drawn_plays_in_range() -> None:
    assert np.array_equal(drawn([LevelLine(16.0, INK)]), drawn([]))
    assert not np.array_equal(drawn([LevelLine(16.0, INK, solid=True)]), drawn([]))


def test_words_that_do_not_fit_beside_a_title_are_left_out() -> None:
    assert np.array_equal(drawn([], words=[("longer than the panel", INK)]), drawn([]))
    assert not np.array_equal(drawn([], words=[("I", INK)]), drawn([]))


def test_columns_share_a_panel_and_bars_are_not_too_wide() -> None:
    plot = replace(PLOT, columns=4)
    assert [plot.middle(k) for k in range(4)] == [20.0, 40.0, 60.0, 80.0]
    assert plot.between(1) == 50.0
    assert plot.column(3, 5.0) == (70.0, 10.0, 20.0, 45.0)
    assert [replace(PLOT, columns=count).bar(0.5) for count in (1, 4, 40)] == [28.0, 10.0, 4.0]


def test_panels_side_by_side_fill_the_picture() -> None:
    left, right = side_by_side(200.0, 70.0, 90.0, rows=2)
    assert [box[1] for box in left] == [box[1] for box in right] == [200.0, 290.0]
    assert left[0][0] == 16.0
    assert left[0][0] + left[0][2] < right[0][0]


def framed(**changes: Any) -> Array:
    usual = {"title": "Title", "subtitle": "", "time": ("12.5 s", "100 s"), "progress": 0.0, "cards": []}
    canvas = PixelCanvas(960, 540)
    Frame(**{**usual, **changes, "pitch": 100.0}).draw(canvas)
    return canvas.pixels()


def test_a_long_subtitle_leaves_the_time_alone() -> None:
    short, long = framed(subtitle="short"), framed(subtitle="very long " * 30)
    assert np.array_equal(short[:, 850:], long[:, 850:])
    assert not np.array_equal(short, long)


def test_events_and_cards_are_drawn_where_they_belong() -> None:
    columns = np.nonzero((framed(events=[Event(0.5, INK)]) != framed()).any(axis=2))[1]
    assert abs(columns.mean() - 479.5) < 1
    changed = framed(cards=[("Label", "1.0"), ("Other", "2.0")]) != framed()
    cards = changed[int(CARDS[1]) : int(CARDS[1] + CARDS[3])].any(axis=(0, 2))
    assert cards[16:108].all()
    assert not cards[108:116].any()
    assert cards[116:208].all()
    assert not cards[208:].any()


def test_a_gauge_takes_what_the_cards_leave_free() -> None:
    gauge = Gauge("Title", "1", INK, [(0.0, 0.5, INK)], [("below", 0.0)], mark=(1.0, INK))
    cards = [("Label", "1.0")]
    columns = np.nonzero((framed(cards=cards, gauge=gauge) != framed(cards=cards)).any(axis=2))[1]
    assert columns.min() >= 124
    assert columns.max() >= 943


def test_a_legend_ends_at_the_right_and_keeps_its_order() -> None:
    one, two = LegendEntry("one", INK), LegendEntry("two", MUTED)
    columns = np.nonzero((framed(legend=[one, two]) != framed()).any(axis=2))[1]
    assert columns.max() > 935
    assert not np.array_equal(framed(legend=[one, two]), framed(legend=[two, one]))
    assert not np.array_equal(framed(caption="so"), framed(caption="so", badge=INK))


def test_tint_lies_between_the_ground_and_the_colour() -> None:
    assert tint(INK, 1.0) == INK
    assert tint(INK, 0.0) == WHITE
    assert tint((100, 0, 200), 0.5, (0, 100, 100)) == (50, 50, 150)


def moment(time_s: float, value: float = 0.0, *, episode: int = 0) -> SimpleNamespace:
    return SimpleNamespace(episode=episode, time_s=time_s, values=np.array([time_s, value]))


def add(history: History, time_s: float, value: float = 0.0, *, episode: int = 0) -> None:
    history.add(moment(time_s, value, episode=episode))


def remembering(most_points: int = 100) -> History:
    return History(("time_s",), ("values",), most_points)


def test_moments_follow_each_other_and_the_last_can_be_told_again() -> None:
    history = remembering()
    assert history.curves() == {}
    add(history, 0.0)
    add(history, 1.0, 5.0)
    add(history, 1.0, 6.0)
    assert history.curves()["time_s"].tolist() == [0.0, 1.0]
    assert history.curves()["values"].tolist() == [[0.0, 0.0], [1.0, 6.0]]


def test_what_tells_two_moments_of_a_time_apart_keeps_both() -> None:
    history = History(("time_s", "sensed"), ("values",), 100)
    for sensed in (0.0, 1.0, 1.0):
        history.add(SimpleNamespace(episode=0, time_s=1.0, values=np.zeros(2), sensed=sensed))
    assert history.curves()["sensed"].tolist() == [0.0, 1.0]


def test_another_episode_time_that_goes_back_and_other_shapes_begin_anew() -> None:
    history = remembering()
    for episode, time_s, known in ((0, 0.0, 1), (0, 2.0, 2), (1, 3.0, 1), (1, 1.0, 1)):
        add(history, time_s, episode=episode)
        assert len(history.every()["time_s"]) == known
    assert history.curves()["values"].tolist() == [[1.0, 0.0]]
    history.add(SimpleNamespace(episode=1, time_s=4.0, values=np.zeros(3)))
    assert history.curves()["values"].shape == (1, 3)


def test_long_episodes_are_thinned_between_the_first_and_the_last_moment() -> None:
    history = remembering(50)
    for k in range(1000):
        add(history, float(k))
        times = history.curves()["time_s"]
        assert (times[0], times[-1]) == (0.0, k)
        assert len(times) <= 52
    assert history.every()["time_s"].tolist() == list(range(1000))


def road() -> Canvas:
    canvas = PixelCanvas(60, 40)
    canvas.fill(ASPHALT)
    return canvas


def changed(canvas: Canvas) -> Array:
    """Pixels (H, W) that are no longer asphalt."""
    return (canvas.pixels() != ASPHALT).any(axis=2)


def test_a_car_fills_its_box_and_heads_right() -> None:
    canvas = road()
    draw_car(canvas, AT, SIZE, RED)
    rows, columns = np.nonzero(changed(canvas))
    assert (columns.min(), columns.max() + 1) == (10, 50)
    assert (rows.min(), rows.max() + 1) == (12, 28)
    picture = canvas.pixels()
    assert tuple(picture[20, 29]) == RED
    windscreen = 10 + round(0.65 * SIZE[0])
    assert tuple(picture[20, windscreen]) == darker(RED, 0.35)


def test_the_rim_is_darker_or_as_given() -> None:
    plain, rimmed = road(), road()
    draw_car(plain, AT, SIZE, RED)
    draw_car(rimmed, AT, SIZE, RED, WHITE)
    assert tuple(plain.pixels()[12, 30]) == darker(RED)
    assert tuple(rimmed.pixels()[12, 30]) == WHITE


def test_cars_of_other_colours_and_sizes_are_not_confused_on_one_canvas() -> None:
    canvas = road()
    for color, size in ((RED, SIZE), (BLUE, SIZE), (BLUE, (8, 6))):
        canvas.fill(ASPHALT)
        draw_car(canvas, AT, size, color)
        alone = road()
        draw_car(alone, AT, size, color)
        assert np.array_equal(canvas.pixels(), alone.pixels())


def test_a_ghost_is_an_outline() -> None:
    canvas = road()
    draw_ghost(canvas, AT, SIZE, WHITE)
    marks = changed(canvas)
    assert marks[12, 30]
    assert not marks[20, 20]


@pytest.mark.parametrize("size", [12, 20])
def test_a_burst_is_as_large_as_asked_for(size: int) -> None:
    canvas = road()
    draw_burst(canvas, (30.0, 20.0), RED, WHITE, size)
    columns = np.nonzero(changed(canvas))[1]
    assert (columns.min(), columns.max() + 1) == (30 - size // 2, 30 + size // 2)
    assert tuple(canvas.pixels()[20, 30]) == WHITE
