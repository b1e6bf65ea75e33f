"""What every reproduction that the tests compute has to repeat: the verdicts of docs/reproduction.json."""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from cps_agents.console import to_json
from cps_paper.chapter import Reproduction
from cps_paper.verdicts import UNKNOWN

READINGS = json.loads((Path(__file__).parents[1] / "docs" / "reproduction.json").read_text(encoding="utf-8"))
PUBLISHED = {(tally["reading"], tally["kind"]): tally["verdicts"] for each in READINGS for tally in each["tallies"]}


def as_published(found: Reproduction[Any], left_out: Collection[str] = ()) -> dict[str, Any]:
    """No verdict on a claim, a cell or an effect is another one, and only these are open; returns the document."""
    for tally in found.tallies():
        known = PUBLISHED[tally.reading, tally.kind]
        left = [name for name, verdict in tally.verdicts.items() if verdict == UNKNOWN]
        assert sorted(left) == sorted(left_out if tally.kind == "claims" else ())
        assert tally.verdicts == {name: UNKNOWN if name in left else known[name] for name in tally.verdicts}
    document: dict[str, Any] = json.loads(to_json(found.document()))
    return document
