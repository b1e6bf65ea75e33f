"""The road around the attacker with the vehicles on it, gaps to scale, and whom each vehicle follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Box, Canvas, Point
from cps_envs.core.picture.marks import decimal
from cps_envs.core.picture.palette import DAMAGE, INK, MUTED, WHITE, tint
from cps_envs.core.picture.vehicle import ASPHALT, MARKING, SHAPE, draw_burst, draw_car, draw_ghost, draw_lane
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.rogue.picture.palette import ALARM, ATTACKER, BRAKE_LIGHT, LAW_COLORS
from cps_envs.rogue.picture.scene import Scene

BEYOND = 3.0  # separations of road shown before and behind the platoon in steady state
LABELS = 18  # pixels below the lane for numbers and gaps
SHORTEST, NARROWEST = 7, 6  # pixels of a vehicle
SMALLEST_RIMMED = 12  # pixels of width, from which on the attacker has a white rim and bursts are large
BURST, SMALL_BURST = 17, 13  # pixels
SIDES = {"linear": (1, -1), "sliding": (1, -1), "front": (1,), "rear": (-1,), "human": (1,)}  # that a law looks to
BRAKING_MPS2 = -1.0  # from which on brake lights are on
MOST_NAMED = 4  # vehicles out of sight that are named


@dataclass(frozen=True)
class RoadWindow:
    """Where things are in pixels; the attacker stays where it is, the road moves."""

    scene: Scene
    lane: Box
    scale: float  # pixels per metre
    begin_m: float  # position of the left end
    centre: FloatArray  # (n,) x of the vehicles' middles
    reference: float  # x of where the leader's middle ought to be
    cars: tuple[tuple[int, int], ...]  # (n,) size of each vehicle

    @property
    def height(self) -> int:
        """Of all vehicles, pixels."""
        return self.cars[0][1]

    @property
    def middle(self) -> float:
        """Height of the middle of the lane."""
        return self.lane[1] + self.lane[3] / 2

    def sight(self, x: float, length: int) -> int:
        """0 if a vehicle of a length whose middle is at x can be seen, -1 if it is out of sight behind, 1 ahead."""
        left, _, width, _ = self.lane
        return int(x > left + width + length / 2) - int(x < left - length / 2)

    def sees(self, vehicle: int) -> bool:
        """Whether a vehicle is in sight."""
        return self.sight(float(self.centre[vehicle]), self.cars[vehicle][0]) == 0


def window_m(scene: Scene) -> tuple[float, float]:
    """Length in m of the road shown, and how far from its beginning the attacker stays."""
    steady, separation_m = len(scene.position) - 1, scene.config.separation_m
    return (steady + 2 * BEYOND) * separation_m, (scene.attacker + BEYOND) * separation_m


def lay_out(scene: Scene, box: Box) -> RoadWindow:
    """The scale is that at which the platoon in steady state fits, with some road before and behind it."""
    left, top, width, height = box
    length_m, behind_m = window_m(scene)
    scale, begin_m = width / length_m, float(scene.position[scene.attacker]) - behind_m
    lane = (left, top, width, height - LABELS)
    lengths = [max(round(length * scale), SHORTEST) for length in scene.length.tolist()]
    height = min(max(round(SHAPE * min(lengths)), NARROWEST), round(0.45 * lane[3]))  # a truck is longer, not wider
    cars = tuple((length, height) for length in lengths)
    centre = left + (scene.position - begin_m) * scale
    return RoadWindow(scene, lane, scale, begin_m, centre, left + (scene.reference_m - begin_m) * scale, cars)


def draw_road(canvas: Canvas, scene: Scene, struck: BoolArray, box: Box) -> None:
    """The lane with everything on and below it; `struck` (n - 1,) are the pairs that are marked as colliding."""
    road = lay_out(scene, box)
    draw_lane(canvas, road.lane, road.scale, road.begin_m, thick=2)
    with canvas.within(road.lane):
        frame = (road.cars[-1][0] + 8, road.height + 8)  # of the leader
        draw_ghost(canvas, (road.reference - frame[0] / 2, road.middle - frame[1] / 2), frame, MARKING)
        for vehicle in range(len(road.centre)):
            draw_links(canvas, road, vehicle)
        draw_vehicles(canvas, road)
        for pair in np.flatnonzero(struck).tolist():
            at = (float(road.centre[pair : pair + 2].mean()), road.middle + road.height / 2 + 5)
            draw_burst(canvas, at, DAMAGE, WHITE, BURST if road.height >= SMALLEST_RIMMED else SMALL_BURST)
    draw_out_of_sight(canvas, road)
    draw_labels(canvas, road)


def draw_links(canvas: Canvas, road: RoadWindow, vehicle: int) -> None:
    """A line from a vehicle to each neighbour that its law looks to: forwards the upper one, backwards the lower."""
    scene, apart = road.scene, max(road.height * 0.2, 2.0)
    for side in SIDES.get(scene.law[vehicle], ()):
        if not 0 <= vehicle + side < len(road.centre):
            continue
        begin = float(road.centre[vehicle]) + side * road.cars[vehicle][0] / 2
        end = float(road.centre[vehicle + side]) - side * road.cars[vehicle + side][0] / 2
        left, right = max(min(begin, end), road.lane[0]), min(max(begin, end), road.lane[0] + road.lane[2])
        if (end - begin) * side > 1 and right > left:
            canvas.box((left, round(road.middle - side * apart) - 1, right - left, 2), LAW_COLORS[scene.law[vehicle]])


def draw_vehicles(canvas: Canvas, road: RoadWindow) -> None:
    """The vehicles in the colours of their laws, the attacker over the others, with brake lights and alarms."""
    scene, top = road.scene, road.middle - road.height / 2
    rimmed = road.height >= SMALLEST_RIMMED
    order = np.argsort(scene.rogue, kind="stable").tolist()
    for i in order:
        car = road.cars[i]
        at = (float(road.centre[i]) - car[0] / 2, top)
        if road.sees(i):
            draw_car(canvas, at, car, LAW_COLORS[scene.law[i]], WHITE if rimmed and scene.rogue[i] else None)
            draw_lights(canvas, car, at, float(scene.acceleration[i]))
            draw_alarm(canvas, road, i, int(scene.alarm[i]))


def draw_lights(canvas: Canvas, car: tuple[int, int], at: Point, acceleration_mps2: float) -> None:
    """Brake lights."""
    width, height = max(round(0.07 * car[0]), 2), max(round(0.24 * car[1]), 2)
    if acceleration_mps2 < BRAKING_MPS2:
        for y in (at[1] + 1, at[1] + car[1] - 1 - height):
            canvas.box((round(at[0]), round(y), width, height), BRAKE_LIGHT)


def draw_alarm(canvas: Canvas, road: RoadWindow, vehicle: int, side: int) -> None:
    """A tip above a vehicle that has detected an attack, towards the side on which it has."""
    if side:
        y, size = road.middle - road.height / 2 - 8, 5
        tip = float(road.centre[vehicle]) + side * (road.cars[vehicle][0] / 2 + 1)
        back = tip - side * 1.7 * size
        canvas.polygon([(tip, y), (back, y - size), (back, y + size)], ALARM)


def draw_out_of_sight(canvas: Canvas, road: RoadWindow) -> None:
    """Who is beyond the ends of the road shown, and how far the nearest of them is from the attacker."""
    left, top, width, height = road.lane
    y = top + height - 11
    distance = np.append(road.scene.position, road.scene.reference_m) - road.scene.position[road.scene.attacker]
    lengths = [car[0] for car in (*road.cars, road.cars[-1])]
    sight = [road.sight(x, length) for x, length in zip((*road.centre.tolist(), road.reference), lengths, strict=True)]
    for side in (-1, 1):
        hidden = [i for i, where in enumerate(sight) if where == side]
        if not hidden:
            continue
        nearest = min(abs(float(distance[i])) for i in hidden)
        label = f"{named(hidden, len(road.centre))}: {'' if len(hidden) == 1 else 'from '}{nearest:.0f} m "
        label += "ahead" if side > 0 else "behind"
        extent = canvas.text_width(label, WHITE, SMALL) + 26
        begin = left + 4 if side < 0 else left + width - 4 - extent
        canvas.box((begin, y - 8, extent, 16), tint(INK, 0.8, ASPHALT), radius=4)
        tip = begin + 6 if side < 0 else begin + extent - 6
        canvas.polygon([(tip, y), *((tip - side * 7, y + 5 * end) for end in (-1, 1))], WHITE)
        canvas.text(label, (begin + (18 if side < 0 else 8), y + 1), WHITE, SMALL)


def named(hidden: list[int], vehicles: int) -> str:
    """The numbers of vehicles; the index after the last vehicle is that of the reference."""
    names = [str(i + 1) if i < vehicles else "reference" for i in hidden]
    return ", ".join(names) if len(names) <= MOST_NAMED else f"{len(names) - (hidden[-1] == vehicles)} vehicles"


def draw_labels(canvas: Canvas, road: RoadWindow) -> None:
    """The vehicles' numbers, the attacker's on a badge, and between them the gaps where there is room."""
    left, top, width, height = road.lane
    scene, y, free = road.scene, top + height + 9, -np.inf
    shown = [i for i in np.argsort(road.centre, kind="stable").tolist() if road.sees(i)]
    ends: dict[int, tuple[float, float]] = {}
    for i in shown:
        label, seized = str(i + 1), bool(scene.rogue[i])
        reach = canvas.text_width(label, INK, 17) / 2 + (5 if seized else 1)
        x = max(min(max(float(road.centre[i]), left + reach), left + width - reach), free + reach)
        if seized:
            canvas.box((x - reach, y - 7, 2 * reach, 14), ATTACKER, radius=3)
        canvas.text(label, (x, y), WHITE if seized else INK, 17, align=0.5)
        ends[i], free = (x - reach, x + reach), x + reach
    for i, gap in enumerate(scene.gap.tolist()):
        label, begin, end = decimal(gap), ends.get(i, (0.0, np.inf))[1], ends.get(i + 1, (0.0, 0.0))[0]
        label += " m" if end - begin > canvas.text_width(label + " m", MUTED, SMALL) + 6 else ""
        if end - begin > canvas.text_width(label, MUTED, SMALL) + 4:
            canvas.text(label, ((begin + end) / 2, y), MUTED, SMALL, align=0.5)
