"""The circle from above: robots, the places that their laws want for them, and their speeds as bars."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.palette import BORDER, DAMAGE, GRID, MUTED, PAGE, WHITE, Color, darker, tint
from cps_paper.testbed.robots.picture.palette import platoon_color
from cps_paper.testbed.robots.picture.scene import Scene

LANE = 17.0  # pixels of width
LABEL, BAR_START, BAR_LENGTH = 22.0, 17.0, 52.0  # pixels from the middle of the episode: outward, and two inward
ROW = 20  # pixels of a line of the legend


@dataclass(frozen=True)
class Circle:
    """Where the circle lies in the picture."""

    center: Point
    radius: float  # pixels
    radius_m: float

    def at(self, angle: float, outward: float = 0.0) -> Point:
        """The pixel at an angle (rad, counterclockwise), so many pixels outside the middle of the episode."""
        reach = self.radius + outward
        return self.center[0] + reach * math.cos(angle), self.center[1] - reach * math.sin(angle)

    def place(self, x_m: float, y_m: float) -> Point:
        """The pixel of a place in metres."""
        scale = self.radius / self.radius_m
        return self.center[0] + scale * x_m, self.center[1] - scale * y_m


def draw_track(canvas: Canvas, scene: Scene, track: Circle) -> None:
    """Everything on and beside the circle."""
    canvas.circle(track.center, track.radius + LANE / 2, BORDER)
    canvas.circle(track.center, track.radius - LANE / 2, PAGE)
    desired = scene.config.desired_speed_mps / scene.config.max_speed_mps
    draw_ring(canvas, track, -BAR_START - BAR_LENGTH * desired, MUTED)
    draw_ring(canvas, track, -BAR_START, GRID)
    draw_desired(canvas, scene, track)
    for q in range(len(scene.pose)):
        draw_robot(canvas, scene, q, track)
    draw_legend(canvas, scene, track)


def draw_ring(canvas: Canvas, track: Circle, outward: float, color: Color) -> None:
    """A thin circle."""
    canvas.path([track.at(angle, outward) for angle in np.linspace(0.0, 2 * math.pi, 181).tolist()], color)


def draw_desired(canvas: Canvas, scene: Scene, track: Circle) -> None:
    """An empty ring where each law wants its robot."""
    radius = body_radius(scene, track)
    for q in np.flatnonzero(np.isfinite(scene.desired_arc_m)).tolist():
        middle, color = track.at(scene.desired_arc_m[q] / scene.config.radius_m), color_of(scene, q)
        canvas.circle(middle, radius + 2.5, color)
        canvas.circle(middle, radius + 1.0, BORDER)


def draw_robot(canvas: Canvas, scene: Scene, q: int, track: Circle) -> None:
    """A robot with its heading, its number, and its speed as a bar that points inward."""
    x_m, y_m, heading = scene.pose[q].tolist()
    angle, color, radius = math.atan2(y_m, x_m), color_of(scene, q), body_radius(scene, track)
    middle = track.place(x_m, y_m)
    canvas.circle(middle, radius + 2.0 * scene.collided[q], DAMAGE if scene.collided[q] else darker(color))
    canvas.circle(middle, radius - 1.2, color)
    nose = (middle[0] + radius * math.cos(heading), middle[1] - radius * math.sin(heading))
    canvas.line(middle, nose, WHITE, 2.0)
    length = BAR_LENGTH * min(max(float(scene.speeds[-1, q]), 0.0) / scene.config.max_speed_mps, 1.0)
    canvas.line(track.at(angle, -BAR_START), track.at(angle, -BAR_START - length), color, 6.0)
    canvas.text(f"{len(scene.pose) - q}", track.at(angle, LABEL), darker(color), 18, align=0.5)


def draw_legend(canvas: Canvas, scene: Scene, track: Circle) -> None:
    """In the middle: whose colour is whose, and what rings and bars mean."""
    platoons, (x, y) = len(scene.disbanding_s), track.center
    y -= ROW * (platoons + 2) / 2
    for place, disbanding_s in enumerate(scene.disbanding_s.tolist()):
        platoon, disbanded = platoons - place, math.isfinite(disbanding_s)
        note = f"Platoon {platoon}: disbanded at {disbanding_s:g} s" if disbanded else f"Platoon {platoon}: automated"
        canvas.text(note, (x, y + ROW * place), platoon_color(platoon, disbanded), 18, align=0.5)
    y += ROW * (platoons + 0.4)
    for line in ("Rings: wanted places", "Bars: speeds", f"Thin circle: {scene.config.desired_speed_mps:g} m/s"):
        canvas.text(line, (x, y), MUTED, 16, align=0.5)
        y += 0.8 * ROW


def body_radius(scene: Scene, track: Circle) -> float:
    """Pixels of half a robot, to scale."""
    return max(track.radius / track.radius_m * scene.config.body_length_m / 2, 3.0)


def color_of(scene: Scene, q: int) -> Color:
    """A robot's colour: its platoon's."""
    platoon = len(scene.disbanding_s) - q // scene.config.vehicles_per_platoon
    return platoon_color(platoon, bool(scene.disbanded[q]))


def shade_of(scene: Scene, q: int) -> Color:
    """A robot's colour among the curves of its platoon: the leader's is the darkest."""
    size = scene.config.vehicles_per_platoon
    return tint(color_of(scene, q), 1.0 - 0.55 * (q % size) / max(size - 1, 1))
