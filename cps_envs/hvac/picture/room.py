"""One zone: its temperature, what the controller believes, its sensors and its heating."""

from __future__ import annotations

import math

from cps_envs.core.picture.canvas import OVERSAMPLING, SMALL, Box, Canvas, Point
from cps_envs.core.picture.palette import BELIEVED, BORDER, FALSE, INK, MUTED, WHITE, Color, darker, tint
from cps_envs.hvac.picture.belief import EstimateSource
from cps_envs.hvac.picture.palette import COOL, HEAT, HONEST, middle_c, temperature_color
from cps_envs.hvac.picture.scene import Scene

WIDE, HIGH = 150, 130  # pixels from which a room has space for words
LEAST_WIDE, LEAST_HIGH = 90, 60  # below which it has space for its number, its temperature and its sensors only
EDGE = 10  # pixels between a wall and what is in the room


def draw_room(canvas: Canvas, scene: Scene, belief: EstimateSource, zone: int, box: Box) -> None:
    """A zone, counted from 0."""
    color = temperature_color(float(scene.temperature[zone]), middle_c(scene.config))
    canvas.box(box, color, radius=6)
    canvas.box(box, darker(color, 0.78), radius=6, border=2)
    spacious = box[2] >= WIDE and box[3] >= HIGH
    with canvas.within(box):
        if box[2] < LEAST_WIDE or box[3] < LEAST_HIGH:
            draw_in_short(canvas, scene, belief, zone, box)
            return
        draw_temperatures(canvas, scene, zone, box, spacious=spacious)
        if spacious:
            draw_unknown_heat(canvas, scene, zone, (box[0] + EDGE, box[1] + 42))
            if scene.shift[zone] != 0.0:
                told = f"told to reach {scene.reference_c[zone] + scene.shift[zone]:.1f} °C"
                canvas.text(told, (box[0] + EDGE, box[1] + 72), FALSE, SMALL)
        draw_sensors(canvas, scene, belief, zone, box, spacious=spacious)
        draw_heating(canvas, scene, zone, box, spacious=spacious)


def draw_in_short(canvas: Canvas, scene: Scene, belief: EstimateSource, zone: int, box: Box) -> None:
    """Number and true temperature of a zone in one line, and discs of its sensors; orange ones are compromised."""
    left, top, width, height = box
    canvas.text(str(zone + 1), (left + 4, top + 9), MUTED, SMALL)
    canvas.text(f"{scene.temperature[zone]:.1f}", (left + width - 4, top + 9), INK, 17, align=1)
    for place, sensor in enumerate(range(zone, scene.config.num_sensors, scene.config.num_zones)):
        color = FALSE if scene.compromised[sensor] else HONEST
        at = (left + 10 + 16 * place, top + height - 10)
        draw_disc(canvas, "", at, 5.5, color, full=bool(belief.believed[sensor]))


def draw_temperatures(canvas: Canvas, scene: Scene, zone: int, box: Box, *, spacious: bool) -> None:
    """The zone's number, its true temperature, and the controller's estimate of it on a label."""
    left, top, width, _ = box
    true, right = scene.temperature[zone], left + width - EDGE
    if not spacious:
        canvas.text(str(zone + 1), (left + 6, top + 12), INK, 20)
        end = left + width - 6
        end -= canvas.text(f"{true:.1f}", (end, top + 12), INK, 22, align=1) + 4
        draw_estimate(canvas, scene, zone, in_short(float(scene.estimate[zone])), (end, top + 12))
        return
    size = 34 if width > 200 else 26
    canvas.text(f"Zone {zone + 1}", (left + EDGE, top + 19), INK, 20)
    canvas.text(f"{true:.2f} °C", (right, top + 20), INK, size, align=1)
    draw_estimate(canvas, scene, zone, f"controller: {scene.estimate[zone]:.2f} °C", (right, top + 46))


def draw_unknown_heat(canvas: Canvas, scene: Scene, zone: int, at: Point) -> None:
    """The heat that nobody measures, if any, and what the filter that the controller follows takes it for."""
    true, believed = float(scene.unknown_heat[zone]), float(scene.believed_heat[zone])
    known = not math.isnan(believed)
    if true != 0.0 or known:
        canvas.text(f"other heat {true:+.0f} W", at, INK, SMALL)
    if known:
        canvas.text(f"believed {believed:+.0f} W", (at[0], at[1] + 15), BELIEVED, SMALL)


def in_short(estimate_c: float) -> str:
    """A temperature with one decimal place; sets that hardly observe the building can make it huge."""
    return f"{estimate_c:.1f}" if abs(estimate_c) < 1000 else f"{estimate_c:.0e}"


def draw_estimate(canvas: Canvas, scene: Scene, zone: int, text: str, end: Point) -> None:
    """A label that ends at a point; nothing before the controller has begun."""
    if scene.step == 0:
        return
    width = canvas.text_width(text, WHITE, 17) + 10
    canvas.box((end[0] - width, end[1] - 9, width, 18), BELIEVED, radius=4)
    canvas.text(text, (end[0] - 5, end[1]), WHITE, 17, align=1)


def draw_sensors(canvas: Canvas, scene: Scene, belief: EstimateSource, zone: int, box: Box, *, spacious: bool) -> None:
    """A label for each sensor of the zone, side by side."""
    left, top, width, height = box
    sensors = range(zone, scene.config.num_sensors, scene.config.num_zones)
    edge = EDGE if spacious else 5
    pitch = (width - 2 * edge + 6) / len(sensors)
    tall = 42 if spacious else 19
    y = top + height - (42 if spacious else 17) - tall
    for place, sensor in enumerate(sensors):
        label = (left + edge + place * pitch, y, min(pitch - 6, 150), tall)
        draw_sensor(canvas, scene, bool(belief.believed[sensor]), sensor, label)


def draw_sensor(canvas: Canvas, scene: Scene, believed: bool, sensor: int, box: Box) -> None:
    """A sensor's number, on a full disc if the controller follows it, and its reading; if forged, also the measured."""
    left, top, width, height = box
    color = FALSE if scene.compromised[sensor] else HONEST
    forged = bool(scene.reading[sensor] != scene.measured[sensor])
    canvas.box(box, tint(FALSE, 0.16) if forged else WHITE, radius=5)
    canvas.box(box, color if believed else tint(color, 0.55), radius=5, border=2 if believed else 1)
    large, roomy = height > 20, width > 90
    radius = (11.0 if roomy else 9.0) if large else 7.0
    raised = 9 if forged and large and not roomy else 0
    x, y = left + 2 * radius + 10, top + height / 2 - raised
    draw_disc(canvas, str(sensor + 1), (left + radius + 5, y), radius, color, full=believed)
    reading, size = f"{scene.reading[sensor]:.1f}", 17 if not large else 24 if roomy else 19
    lifted = 8 if forged and roomy and large else 0
    unit = " °C" if width > 120 and large else ""
    canvas.text(reading + unit, (x, y - lifted), color if forged else INK, size)
    if forged and large:
        words = "forged, was" if width > 120 else "not"
        at = (x, y + 10) if roomy else (left + 7, top + height - 10)
        canvas.text(f"{words} {scene.measured[sensor]:.1f}", at, MUTED, SMALL)


def draw_disc(canvas: Canvas, number: str, centre: Point, radius: float, color: Color, *, full: bool) -> None:
    """A number on a disc, full or as a ring."""
    size = round(2 * radius) + 2

    def paint(large: Canvas) -> None:
        middle = (OVERSAMPLING * size / 2, OVERSAMPLING * size / 2)
        large.circle(middle, OVERSAMPLING * radius, color)
        if not full:
            large.circle(middle, OVERSAMPLING * (radius - 1.5), WHITE)

    at = (centre[0] - size / 2, centre[1] - size / 2)
    canvas.sprite(("disc", radius, color, full), (size, size), at, paint)
    canvas.text(number, (centre[0] + 0.5, centre[1] + 0.5), WHITE if full else color, round(1.8 * radius), align=0.5)


def draw_heating(canvas: Canvas, scene: Scene, zone: int, box: Box, *, spacious: bool) -> None:
    """Heating, or cooling, power as a bar of its limit, and in watts."""
    left, top, width, height = box
    power, commanded = float(scene.supplied[zone]), float(scene.heating[zone])
    limits = scene.config.min_heating_w if power < 0 else scene.config.max_heating_w
    share = power / (float(limits[zone] if isinstance(limits, tuple) else limits) or 1.0)
    edge, thick = (EDGE, 8) if spacious else (5, 5)
    bar = (left + edge, top + height - edge - thick + 2, width - 2 * edge, thick)
    if spacious:
        canvas.text("cooling" if power < 0 else "heating", (bar[0], bar[1] - 9), INK, SMALL)
        forged = round(power) != round(commanded)
        words = f"{abs(power):.0f} W" + (f", not {commanded:.0f}" if forged else "")
        canvas.text(words, (bar[0] + bar[2], bar[1] - 9), FALSE if forged else INK, 17, align=1)
    canvas.box(bar, WHITE, radius=2)
    if share > 0:
        canvas.box((bar[0], bar[1], max(bar[2] * share, 3.0), thick), COOL if power < 0 else HEAT, radius=2)
    canvas.box(bar, BORDER if share == 0 else darker(WHITE, 0.7), radius=2, border=1)
