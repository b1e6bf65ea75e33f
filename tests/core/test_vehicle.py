from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.palette import WHITE, darker
from cps_envs.core.picture.pixels import PixelCanvas
from cps_envs.core.picture.vehicle import ASPHALT, draw_burst, draw_car, draw_ghost
from cps_envs.core.types import Array

pytest.importorskip("pygame")

RED, BLUE = (200, 30, 40), (40, 60, 200)
SIZE, AT = (40, 16), (10.0, 12.0)


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
