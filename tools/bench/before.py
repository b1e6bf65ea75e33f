"""What rows were at an older commit, and what they were beside it, both from one run of `tools.bench.against`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

Best: TypeAlias = Callable[[Iterable[float]], float]
PATH = Path(__file__).with_name("before.json")
VALUES: Mapping[str, tuple[str, Best]] = {
    "sizes": ("substep_ns", min),
    "resets": ("reset_us", min),
    "threads": ("speed_up", max),
}


def published() -> dict[str, Any]:
    """The commit, the machine, and each row's value `before` and `now`; no rows where nothing was published."""
    return json.loads(PATH.read_text("utf-8")) if PATH.exists() else {"rows": {}}
