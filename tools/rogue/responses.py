"""The search behind `responses.json`: the laws of `informed` against each attacker of preset `learning`.

`python -m tools.rogue.responses responses.json` makes the file anew; it takes a quarter of an hour.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from cps_baselines.rogue.informed import Informed
from cps_envs.core.game.play import play_episodes
from cps_envs.rogue.problem import ROGUE
from tools.rivals.rogue import ATTACKERS

BEHIND = ("ff", "ss", "fs", "sF", "ll", "fh")  # laws far behind and just behind the attacker
AHEAD = ("fff", "sss", "lll", "llf", "ssl", "rrr", "rrf")  # just ahead, far ahead, leader
CALM = ("fffff", "ssfff", "sslll")  # while the attacker is far away
NEAR_M = (3.0, 12.0, 25.0)
BEFORE = ("s", "f")
MONITOR = {"apart": "fffff", "evade": "ssssl", "near_m": 20.0}  # nearly what `monitor` does
SEARCHED = 60_000_000  # first seed
SCREENED, JUDGED, FINALISTS = 12, 32, 4


def respond(attacker: str) -> dict[str, Any]:
    """The best of the laws above against an attacker: first the same at all times, then others while it is far away."""
    static = [{"apart": laws, "evade": laws, "near_m": 0.0} for laws in map("".join, product(BEHIND, AHEAD))]
    finalists = _best(attacker, static, SCREENED, FINALISTS)
    dynamic = [
        {"apart": calm, "evade": each["evade"], "near_m": near_m}
        for each, calm, near_m in product(finalists[:2], CALM, NEAR_M)
    ]
    finalists += [*_best(attacker, dynamic, SCREENED, FINALISTS), MONITOR]
    (best,) = _best(attacker, [{"before": law, **each} for each in finalists for law in BEFORE], JUDGED, 1)
    return {"against": attacker, "horizon_s": 1.0, **best}


def _best(attacker: str, choices: Sequence[dict[str, Any]], episodes: int, count: int) -> list[dict[str, Any]]:
    """The choices with the lowest mean return, the best first."""
    config = ROGUE.config("learning", {})
    spec = ROGUE.game(config, 1).spec("defender")
    seeds = range(SEARCHED + episodes, SEARCHED + 2 * episodes)
    paid = []
    for choice in choices:
        players = {"attacker": attacker, "defender": Informed(spec, **choice)}
        paid.append(float(play_episodes(ROGUE, config, players, list(seeds))["return"].mean()))  # type: ignore[arg-type]
    order = sorted(range(len(choices)), key=paid.__getitem__)
    return [choices[k] for k in order[:count]]


if __name__ == "__main__":
    found = [respond(contestant.reference) for contestant in ATTACKERS]
    Path(sys.argv[1]).write_text(json.dumps({"found": found}, indent=1) + "\n", encoding="utf-8")
