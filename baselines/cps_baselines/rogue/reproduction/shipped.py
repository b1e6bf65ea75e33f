"""Tables that come with this package; lines that start with # explain them."""

from __future__ import annotations

import csv
from importlib.resources import files


def shipped_rows(name: str) -> list[dict[str, str]]:
    """The rows of `<name>.csv` beside this module."""
    text = files("cps_baselines.rogue.reproduction").joinpath(f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
