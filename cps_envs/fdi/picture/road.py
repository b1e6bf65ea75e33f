"""The platoon on its lane, to scale, and above it where attacked range sensors believe the vehicle ahead to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Box, Canvas, Point
from cps_envs.core.picture.palette import DAMAGE, FALSE, INK, MUTED, WHITE, tint
from cps_envs.core.picture.vehicle import ASPHALT, MARKING, SHAPE, SHOULDER, VEHICLE_M, draw_burst, draw_car, draw_ghost
from cps_envs.core.types import FloatArray
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.picture.beliefs import belief_color, beliefs_of, draw_beliefs
from cps_envs.fdi.picture.palette import TARGET, VEHICLE
from cps_envs.fdi.picture.scene import Scene

AHEAD_GAPS, BEHIND_GAPS = 2.5, 1.5  # desired gaps of road shown ahead of the reference and behind the last vehicle
GHOSTS, LANE = 38, 46  # pixels of height: what is believed, and the lane
NARROWEST = 11  # pixels of a vehicle's width
MOST_WITH_UNIT = 10  # vehicles, above which gaps are written without their unit


@dataclass(frozen=True)
class Road:
    """Where things are in pixels: x of front bumpers, and of the reference's rear end."""

    scene: Scene
    lane: Box
    scale: float  # pixels per metre
    front: FloatArray  # (n,) vehicles 1 (last) to n (lead)
    reference: float
    car: tuple[int, int]  # size of a vehicle

    @property
    def middle(self) -> float:
        """Height of the middle of the lane."""
        return self.lane[1] + self.lane[3] / 2

    def ahead(self, vehicle: int) -> float:
        """Rear end of what is ahead of a vehicle, counted from 0."""
        return float(self.front[vehicle + 1] - self.car[0]) if vehicle + 1 < len(self.front) else self.reference


def lay_out(scene: Scene, box: Box) -> Road:
    """The reference stays where it is; the scale is that of the steady state unless the platoon becomes longer."""
    left, top, width, _ = box
    n, desired_m = len(scene.gap), scene.config.desired_gap_m
    lead_first = scene.gap[::-1]
    behind_m = (np.cumsum(lead_first) + VEHICLE_M * np.arange(n))[::-1]  # reference's rear to front bumpers
    ahead_m = VEHICLE_M + AHEAD_GAPS * desired_m
    steady_m = n * (VEHICLE_M + desired_m) + BEHIND_GAPS * desired_m
    longest_m = max(steady_m, float(behind_m.max()) + VEHICLE_M + desired_m / 2)
    scale = width / (ahead_m + longest_m)
    reference = left + width - ahead_m * scale
    length = max(round(VEHICLE_M * scale), 6)
    car = (length, min(max(round(SHAPE * length), NARROWEST), LANE - 14))
    lane = (left, top + GHOSTS, width, LANE)
    return Road(scene, lane, scale, reference - behind_m * scale, reference, car)


def draw_road(canvas: Canvas, scene: Scene, box: Box) -> None:
    """The lane with everything on, above and below it."""
    road = lay_out(scene, box)
    draw_lane(canvas, road)
    with canvas.within(road.lane):
        for vehicle in range(len(scene.gap)):
            draw_beam(canvas, road, vehicle)
        draw_vehicles(canvas, road)
    beliefs = beliefs_of(scene, road.front.tolist(), road.scale)
    draw_beliefs(canvas, beliefs, (box[0], box[1], box[2], GHOSTS), road.car[0])
    draw_labels(canvas, road)
    draw_bracket(canvas, road)


def draw_lane(canvas: Canvas, road: Road) -> None:
    """Asphalt, and the target's gap on it."""
    left, top, width, height = road.lane
    canvas.box(road.lane, ASPHALT, radius=2)
    with canvas.within(road.lane):
        rear, end = road.front[road.scene.target - 1] - road.car[0], road.ahead(road.scene.target - 1) + road.car[0]
        canvas.box((rear - 5, top + 3, end - rear + 10, height - 6), tint(TARGET, 0.5, ASPHALT), radius=6)
    for y in (top + 1, top + height - 2):
        canvas.box((left, y, width, 1), SHOULDER)


def draw_beam(canvas: Canvas, road: Road, vehicle: int) -> None:
    """What a vehicle's front sensors see the one ahead with: grey, or coloured where attacked or replaced."""
    scene = road.scene
    begin, end, reach = float(road.front[vehicle]), road.ahead(vehicle), road.car[1] * 0.4
    if end - begin < 1:
        return
    color = belief_color(scene, vehicle)
    fill, rim = (MARKING, 0.22), (MARKING, 0.35)
    if color is not None:
        fill, rim = (color, 0.75), (color, 0.9)
    corners = [(begin, road.middle), (end, road.middle - reach), (end, road.middle + reach)]
    canvas.polygon(corners, tint(*fill, ASPHALT))
    canvas.path([*corners, corners[0]], tint(*rim, ASPHALT))


def draw_vehicles(canvas: Canvas, road: Road) -> None:
    """The vehicles, those with attacked sensors coloured, the reference as an outline, and collisions."""
    scene, n, top = road.scene, len(road.front), road.middle - road.car[1] / 2
    draw_ghost(canvas, (road.reference, top), road.car, MARKING)
    for i in range(n):
        attacked = bool(scene.attacked[i] or scene.attacked[n + i])
        draw_car(canvas, (float(road.front[i]) - road.car[0], top), road.car, FALSE if attacked else VEHICLE)
    if scene.metrics["collided_pairs"]:
        for i in np.flatnonzero(scene.gap <= SLACK).tolist():
            draw_burst(canvas, (float(road.front[i]), road.middle), DAMAGE, WHITE)


def draw_labels(canvas: Canvas, road: Road) -> None:
    """The vehicles' numbers and the true gaps below the lane."""
    scene, n = road.scene, len(road.front)
    y, free = road.lane[1] + road.lane[3] + 9, road.reference + 4
    for i in range(n):
        canvas.text(str(i + 1), (float(road.front[i]) - road.car[0] / 2, y), INK, 17, align=0.5)
        if i + 1 != scene.target and scene.gap[i] > SLACK:
            label = f"{scene.gap[i]:.1f}" + (" m" if n <= MOST_WITH_UNIT else "")
            between: Point = ((float(road.front[i]) + road.ahead(i)) / 2, y)
            free = max(free, between[0] + canvas.text(label, between, MUTED, SMALL, align=0.5) / 2 + 4)
    canvas.text("reference", (free, y), MUTED, SMALL)


def draw_bracket(canvas: Canvas, road: Road) -> None:
    """The target's gap, with its length, below the numbers."""
    scene, i = road.scene, road.scene.target - 1
    begin, end = float(road.front[i]), max(road.ahead(i), float(road.front[i]) + 1)
    y = road.lane[1] + road.lane[3] + 4
    color = DAMAGE if scene.metrics["collided_target"] else TARGET
    for x in (begin, end - 1):
        canvas.box((x, y - 2, 1, 17), color)
    label = f"target gap {scene.gap[i]:.2f} m"
    width, middle = canvas.text_width(label, WHITE, SMALL) + 12, (begin + end) / 2
    canvas.box((begin, y + 14, max(end - begin, 1), 1), color)
    canvas.box((middle - width / 2, y + 14, width, 14), color, radius=3)
    canvas.text(label, (middle, y + 22), WHITE, SMALL, align=0.5)
