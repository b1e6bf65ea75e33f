"""The rooms of the core import only from rooms below them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import cps_envs.core

CORE = Path(cps_envs.core.__file__).parent
FLOORS = (  # from the ground up; single files below all rooms
    *("errors", "types", "documents"),
    *("compute", "declare", "policies", "game", "picture", "learning", "interfaces", "conformance"),
)


def arrows() -> Iterator[tuple[str, str, str]]:
    """Every import of one room by another, those inside functions too, with the file that imports."""
    for file in CORE.rglob("*.py"):
        room = file.relative_to(CORE).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cps_envs.core."):
                yield room, str(node.module).split(".")[2], str(file.relative_to(CORE))


def test_the_core_has_no_other_rooms() -> None:
    found = {place.stem for place in CORE.iterdir() if not place.name.startswith("__")}
    assert found == set(FLOORS)


def test_rooms_import_only_from_rooms_below_them() -> None:
    up = [arrow for arrow in arrows() if FLOORS.index(arrow[1]) > FLOORS.index(arrow[0])]
    assert not up
