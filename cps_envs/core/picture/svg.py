"""A recorded picture as SVG."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from xml.sax.saxutils import escape

from cps_envs.core.picture.canvas import OVERSAMPLING
from cps_envs.core.picture.lettering import FAMILY
from cps_envs.core.picture.recording import Recorder, Shape

THIN = 1.2  # pixels of a path


def to_svg(recorder: Recorder, title: str) -> str:
    """The picture that is on a recorder, as a document with a title for those who do not see it."""
    width, height = recorder.size
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'role="img" font-family="{FAMILY}" font-weight="bold">',
        f"<title>{escape(title)}</title>",
        "<defs>",
        *_sprites(recorder),
        *_clips(recorder.shapes),
        "</defs>",
        *_shapes(recorder.shapes, width, height),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _sprites(recorder: Recorder) -> Iterator[str]:
    for number, sprite in enumerate(recorder.sprites):
        yield f'<g id="s{number}"><g transform="scale({1 / OVERSAMPLING:g})">'
        yield from _shapes(sprite.shapes, *(OVERSAMPLING * side for side in sprite.size))
        yield "</g></g>"


def _clips(shapes: Sequence[Shape]) -> Iterator[str]:
    for box in dict.fromkeys(shape[1:] for shape in shapes if shape[0] == "clip" and len(shape) > 1):
        yield f'<clipPath id="{_clip_id(box)}"><rect {_place(box)}/></clipPath>'


def _clip_id(box: Iterable[float]) -> str:
    return "c" + "_".join(f"{side:g}" for side in box)


def _shapes(shapes: Sequence[Shape], width: int, height: int) -> Iterator[str]:
    clipped = False
    for kind, *rest in shapes:
        if kind == "clip":
            if clipped:
                yield "</g>"
            clipped = bool(rest)
            if clipped:
                yield f'<g clip-path="url(#{_clip_id(rest)})">'
        elif kind == "fill":
            yield f'<rect width="{width}" height="{height}" fill="{rest[0]}"/>'
        else:
            yield _WRITERS[kind](*rest)
    if clipped:
        yield "</g>"


def _place(box: Sequence[float]) -> str:
    return 'x="{:g}" y="{:g}" width="{:g}" height="{:g}"'.format(*box)


def _box(color: str, left: float, top: float, width: float, height: float, radius: float, border: float) -> str:
    radius = min(radius, width / 2, height / 2)
    rounded = f' rx="{radius:g}"' if radius else ""
    if not border:
        sharp = "" if radius else ' shape-rendering="crispEdges"'  # no seam between neighbours
        return f'<rect {_place((left, top, width, height))}{rounded}{sharp} fill="{color}"/>'
    inner = (left + border / 2, top + border / 2, width - border, height - border)
    return f'<rect {_place(inner)}{rounded} fill="none" stroke="{color}" stroke-width="{border:g}"/>'


def _polygon(color: str, *numbers: float) -> str:
    return f'<polygon points="{_points(numbers)}" fill="{color}"/>'


def _path(color: str, *numbers: float) -> str:
    shifted = [number + 0.5 for number in numbers]  # pygame counts from the middle of the first pixel
    return f'<polyline points="{_points(shifted)}" fill="none" stroke="{color}" stroke-width="{THIN}"/>'


def _points(numbers: Sequence[float]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in zip(numbers[::2], numbers[1::2], strict=True))


def _line(color: str, thickness: float, *numbers: float) -> str:
    return (
        f'<polyline points="{_points(numbers)}" fill="none" stroke="{color}" stroke-width="{thickness:g}" '
        'stroke-linecap="round"/>'
    )


def _circle(color: str, radius: float, x: float, y: float) -> str:
    return f'<circle cx="{x:g}" cy="{y:g}" r="{radius:g}" fill="{color}"/>'


def _dashes(
    color: str, left: float, top: float, width: float, height: float, period: float, length: float, phase: float
) -> str:
    middle = top + height / 2
    return (
        f'<line x1="{left:g}" y1="{middle:g}" x2="{left + width:g}" y2="{middle:g}" stroke="{color}" '
        f'stroke-width="{height:g}" stroke-dasharray="{length:g} {period - length:g}" '
        f'stroke-dashoffset="{-phase % period:g}"/>'
    )


def _text(color: str, size: float, left: float, baseline: float, width: float, text: str) -> str:
    fitted = f' textLength="{width:g}" lengthAdjust="spacingAndGlyphs"' if len(text) > 1 else ""
    return f'<text x="{left:g}" y="{baseline:g}" font-size="{size:g}" fill="{color}"{fitted}>{escape(text)}</text>'


def _sprite(number: int, left: float, top: float) -> str:
    return f'<use href="#s{number}" x="{left:g}" y="{top:g}"/>'


_WRITERS: dict[str, Callable[..., str]] = {
    "box": _box,
    "polygon": _polygon,
    "path": _path,
    "line": _line,
    "circle": _circle,
    "dashes": _dashes,
    "text": _text,
    "sprite": _sprite,
}
