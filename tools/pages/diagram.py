"""The block diagram of a problem: one control loop, what the attacker touches in it and what the defender does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 720, 265
BOX_WIDTH, BOX_HEIGHT = 190, 62
INK, MUTED, PANEL, BORDER = "#1c2430", "#687280", "#ffffff", "#8a94a3"
ATTACK, DEFENSE = "#c2410c", "#0f766e"
CORNERS: Mapping[str, tuple[int, int]] = {  # centres of the boxes
    "controller": (115, 75),
    "plant": (360, 75),
    "sensors": (605, 75),
    "estimator": (360, 195),
}


@dataclass(frozen=True)
class Loop:
    """The words in the boxes of a control loop, and which of them each side has its hands on."""

    plant: str
    sensors: str
    estimator: str
    controller: str
    attacker: str  # one of the above, by its name
    attack: str  # what it does there
    defender: str
    defense: str


LOOPS: Mapping[str, Loop] = {
    "disbanding": Loop(
        plant="vehicles of ten platoons",
        sensors="gaps, speeds, radio",
        estimator="who is disbanded?",
        controller="platoon controllers",
        attacker="plant",
        attack="disbands platoons",
        defender="controller",
        defense="adds corrections",
    ),
    "fdi": Loop(
        plant="vehicles of a platoon",
        sensors="range and range-rate",
        estimator="filter of the platoon",
        controller="following controllers",
        attacker="sensors",
        attack="adds small lies",
        defender="estimator",
        defense="rejects readings",
    ),
    "hvac": Loop(
        plant="heated zones",
        sensors="thermometers",
        estimator="observers, one per set",
        controller="predictive controller",
        attacker="sensors",
        attack="replaces readings",
        defender="estimator",
        defense="chooses the set",
    ),
    "rogue": Loop(
        plant="vehicles of a platoon",
        sensors="gaps and speeds",
        estimator="detectors, alarms",
        controller="controller per vehicle",
        attacker="plant",
        attack="drives one vehicle",
        defender="controller",
        defense="chooses controllers",
    ),
}


def diagram(name: str) -> str:
    """The loop of a problem as a self-contained SVG."""
    loop = LOOPS[name]
    says = f"Control loop of {name}: the attacker {loop.attack} ({loop.attacker}), the defender {loop.defense}."
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{escape(says, quote=True)}" font-family="system-ui, sans-serif" font-size="15">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="8" fill="#f6f7f9"/>',
        '<defs><marker id="end" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" '
        f'orient="auto"><path d="M0 0 L10 5 L0 10 z" fill="{MUTED}"/></marker></defs>',
        *_arrows(),
        *(part for corner in CORNERS for part in _box(loop, corner)),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _arrows() -> Iterator[str]:
    left, middle, right = CORNERS["controller"][0], CORNERS["plant"][0], CORNERS["sensors"][0]
    top, low, half, rise = CORNERS["plant"][1], CORNERS["estimator"][1], BOX_WIDTH // 2, BOX_HEIGHT // 2
    yield _arrow(f"M{left + half} {top} H{middle - half}")
    yield _arrow(f"M{middle + half} {top} H{right - half}")
    yield _arrow(f"M{right} {top + rise} V{low} H{middle + half}")
    yield _arrow(f"M{middle - half} {low} H{left} V{top + rise}")


def _arrow(path: str) -> str:
    return f'<path d="{path}" fill="none" stroke="{MUTED}" stroke-width="2" marker-end="url(#end)"/>'


def _box(loop: Loop, corner: str) -> Iterator[str]:
    x, y = CORNERS[corner]
    hands = {loop.attacker: (ATTACK, f"attacker {loop.attack}"), loop.defender: (DEFENSE, f"defender {loop.defense}")}
    color, note = hands.get(corner, (BORDER, ""))
    dash = ' stroke-dasharray="7 4"' if corner == loop.attacker else ""
    yield (
        f'<rect x="{x - BOX_WIDTH // 2}" y="{y - BOX_HEIGHT // 2}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="6" '
        f'fill="{PANEL}" stroke="{color}" stroke-width="{3 if note else 1.5}"{dash}/>'
    )
    yield f'<text x="{x}" y="{y - 6}" text-anchor="middle" font-size="12" fill="{MUTED}">{corner}</text>'
    yield f'<text x="{x}" y="{y + 14}" text-anchor="middle" fill="{INK}">{escape(getattr(loop, corner))}</text>'
    if note:
        beside = y + BOX_HEIGHT // 2 + 20 if corner == "estimator" else y - BOX_HEIGHT // 2 - 10
        yield (
            f'<text x="{x}" y="{beside}" font-size="13" font-weight="600" text-anchor="middle" fill="{color}">'
            f"{escape(note)}</text>"
        )
