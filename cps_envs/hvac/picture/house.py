"""The building: rooms coloured by their temperature on the ground and under the sky, and the links between them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import INK
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import EstimateSource
from cps_envs.hvac.picture.layout import HouseLayout, arrange
from cps_envs.hvac.picture.palette import WALL, middle_c, temperature_color
from cps_envs.hvac.picture.room import draw_room
from cps_envs.hvac.picture.scene import Scene

GAP, NARROW = 14, 8  # pixels between rooms, and where more than four storeys are drawn
SKY, GROUND = 24, 22  # pixels of height
NARROWEST, WIDEST = 0.16, 0.5  # share of a wall that a link takes, by its conductance
LETTERS = 16  # pixels


class House:
    """Where everything is, for one configuration."""

    def __init__(self, config: HvacConfig, box: Box) -> None:
        self._config = config
        self._box = box
        left, top, width, height = box
        below = GROUND + GAP if config.ground_zones else 0
        self._inner: Box = (left, top + SKY + GAP, width, height - SKY - GAP - below)
        self._layout: HouseLayout = arrange(config, width / self._inner[3])
        self._gap = GAP if self._layout.rows <= 4 else NARROW
        self._adjacent = self._layout.adjacent()

    @cached_property
    def rooms(self) -> list[Box]:
        """The box of each zone."""
        left, top, width, height = self._inner
        wide, high = width + self._gap, (height + self._gap) / self._layout.rows
        places = zip(*(values.tolist() for values in self._layout), strict=True)
        return [
            (left + begin * wide, top + row * high, (end - begin) * wide - self._gap, high - self._gap)
            for row, begin, end in places
        ]

    @cached_property
    def doors(self) -> list[Box]:
        """A box across the wall between linked neighbours, the wider the better they conduct."""
        conductance = 1.0 / np.array(self._config.link_resistance_k_per_w)
        shares = NARROWEST + (WIDEST - NARROWEST) * conductance / conductance.max(initial=0)
        return [
            _between(self.rooms[zone], self.rooms[other], share, self._gap)
            for (zone, other), share in zip(self._links, shares.tolist(), strict=True)
            if self._adjacent[zone, other]
        ]

    @cached_property
    def afar(self) -> str:
        """The links between zones that share no wall in the picture, in words."""
        names = [f"{zone + 1}-{other + 1}" for zone, other in self._links if not self._adjacent[zone, other]]
        return f"also linked: {', '.join(names)}" if names else ""

    @property
    def _links(self) -> list[tuple[int, int]]:
        ends = [zone - 1 for zone in self._config.link_zones]
        return list(zip(ends[::2], ends[1::2], strict=True))

    def draw(self, canvas: Canvas, scene: Scene, belief: EstimateSource) -> None:
        """The picture of a moment."""
        self._draw_surroundings(canvas, scene)
        for door in self.doors:
            canvas.box(door, WALL)
        for zone, box in enumerate(self.rooms):
            draw_room(canvas, scene, belief, zone, box)

    def _draw_surroundings(self, canvas: Canvas, scene: Scene) -> None:
        left, top, width, height = self._box
        expected = "" if scene.forecast_c == scene.outdoor_c else f", forecast {scene.forecast_c:.1f} °C"
        layers = [("Outside", scene.outdoor_c, top, SKY, expected)]
        if self._config.ground_zones:
            layers.append(("Ground", scene.ground_c, top + height - GROUND, GROUND, ""))
        for name, value, y, high, more in layers:
            canvas.box((left, y, width, high), temperature_color(value, middle_c(self._config)), radius=4)
            canvas.text(f"{name} {value:.1f} °C{more}", (left + 12, y + high / 2), INK, LETTERS)
        canvas.text(self.afar, (left + width - 12, top + SKY / 2), INK, LETTERS, align=1)


def _between(one: Box, two: Box, share: float, gap: float) -> Box:
    """A box through the wall that two neighbours share, as long as `share` of it."""
    begin = [max(one[side], two[side]) for side in (0, 1)]
    end = [min(one[side] + one[side + 2], two[side] + two[side + 2]) for side in (0, 1)]
    width, height = end[0] - begin[0], end[1] - begin[1]
    if width < 0:
        return (end[0] - 2, begin[1] + height * (1 - share) / 2, gap + 4, height * share)
    return (begin[0] + width * (1 - share) / 2, end[1] - 2, width * share, gap + 4)
