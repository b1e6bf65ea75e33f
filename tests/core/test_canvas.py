from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.palette import PAGE, WHITE, color_scale, darker
from cps_envs.core.picture.pixels import PixelCanvas
from cps_envs.core.types import FloatArray

pytest.importorskip("pygame")

INK = (20, 40, 60)
SIZE = (60, 40)


def blank() -> Canvas:
    canvas = PixelCanvas(*SIZE)
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
    middles = [(share.sum(axis=axis) * (np.arange(size) + 0.5)).sum() / share.sum() for axis, size in enumerate(SIZE)]
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
