"""The building: rooms coloured by their temperature on the ground and under the sky, and the links between them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cps_envs.core.canvas import Box, Canvas
from cps_envs.core.palette import INK
from cps_envs.hvac.belief import Belief
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.layout import Layout, arrange
from cps_envs.hvac.palette import WALL, temperature_color
from cps_envs.hvac.room import draw_room
from cps_envs.hvac.scene import Scene

GAP = 14  # pixels between rooms
SKY, GROUND = 24, 22  # pixels of height
NARROWEST, WIDEST = 0.16, 0.5  # share of a wall that a link takes, by its conductance
SMALL = 16


class House:
    """Where everything is, for one configuration."""

    def __init__(self, config: HvacConfig, box: Box) -> None:
        self._config = config
        self._box = box
        left, top, width, height = box
        below = GROUND + GAP if config.ground_zones else 0
        self._inner: Box = (left, top + SKY + GAP, width, height - SKY - GAP - below)
        self._layout: Layout = arrange(config, width / self._inner[3])

    @cached_property
    def rooms(self) -> list[Box]:
        """The box of each zone."""
        left, top, width, height = self._inner
        wide = (width + GAP) / self._layout.columns
        high = (height + GAP) / self._layout.rows
        cells = self._layout.cells.tolist()
        return [(left + column * wide, top + row * high, wide - GAP, high - GAP) for row, column in cells]

    @cached_property
    def doors(self) -> list[Box]:
        """A box across the wall between linked neighbours, the wider the better they conduct."""
        config, boxes = self._config, []
        conductance = 1.0 / np.array(config.link_resistance_k_per_w)
        for (zone, other), share in zip(self._links, (conductance / conductance.max(initial=0)).tolist(), strict=True):
            if self._layout.adjacent(zone, other):
                one, two = sorted((self.rooms[zone], self.rooms[other]))
                boxes.append(_between(one, two, NARROWEST + (WIDEST - NARROWEST) * share))
        return boxes

    @cached_property
    def afar(self) -> str:
        """The links between zones that are not neighbours in the picture, in words."""
        apart = [link for link in self._links if not self._layout.adjacent(*link)]
        names = ", ".join(f"{zone + 1}-{other + 1}" for zone, other in apart)
        return f"also linked: {names}" if apart else ""

    @property
    def _links(self) -> list[tuple[int, int]]:
        ends = [zone - 1 for zone in self._config.link_zones]
        return list(zip(ends[::2], ends[1::2], strict=True))

    def draw(self, canvas: Canvas, scene: Scene, belief: Belief) -> None:
        """The picture of a moment."""
        self._draw_surroundings(canvas, scene)
        for door in self.doors:
            canvas.box(door, WALL)
        for zone, box in enumerate(self.rooms):
            draw_room(canvas, scene, belief, self._config, zone, box)

    def _draw_surroundings(self, canvas: Canvas, scene: Scene) -> None:
        left, top, width, height = self._box
        layers = [("Outside", scene.outdoor_c, top, SKY)]
        if self._config.ground_zones:
            layers.append(("Ground", self._config.ground_c, top + height - GROUND, GROUND))
        for name, value, y, high in layers:
            canvas.box((left, y, width, high), temperature_color(value, self._config.reference_c), radius=4)
            canvas.text(f"{name} {value:.1f} °C", (left + 12, y + high / 2), INK, SMALL)
        canvas.text(self.afar, (left + width - 12, top + SKY / 2), INK, SMALL, align=1)


def _between(one: Box, two: Box, share: float) -> Box:
    """A box that joins the walls of two neighbours, of which the first is left of or above the second."""
    left, top, width, height = one
    if two[0] > left + width / 2:
        return (left + width - 2, top + height * (1 - share) / 2, GAP + 4, height * share)
    return (left + width * (1 - share) / 2, top + height - 2, width * share, GAP + 4)
