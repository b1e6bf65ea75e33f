"""What makes a meeting the same meeting, and when a finished one is believed."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import cps_baselines
import cps_envs
from cps_agents.arena.meeting import Meeting, attempt
from cps_agents.arena.play import play
from cps_agents.arena.store import Store, _digest, file_name, fingerprint, identity
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.workers import Workers
from cps_envs import PROBLEMS
from cps_envs.core.declare.panel import Contestant

VENUE = Venue("rogue", "paper", {"duration_s": 2.0})
NONE, PD = Contestant("none"), Contestant("pd")
POLICY = "import numpy as np\nfrom tests.agents.players import Constant\nclass Mine(Constant): value = {}\n"


def meeting(venue: Venue = VENUE, attacker: Contestant = NONE, label: str = "") -> Meeting:
    return Table(venue, [attacker], [PD], 2, name=label).meeting((0, 0))


def test_who_asks_plays_no_role() -> None:
    same = [
        meeting(label="table 1"),
        meeting(attacker=Contestant("idle", "none", title="nobody")),
        meeting(VENUE.changed({"power_ratio": VENUE.config.power_ratio})),  # what the preset says anyway
    ]
    assert {file_name(each) for each in same} == {file_name(meeting())}
    others = [meeting(VENUE.changed({"power_ratio": 1.3})), meeting(attacker=Contestant("none", "square"))]
    others += [replace(meeting(), first_seed=5), replace(meeting(), episodes=3)]
    assert len({file_name(each) for each in (*others, meeting())}) == 5
    assert "label" not in identity(meeting())


def test_a_meeting_in_two_tables_is_played_once(tmp_path: Path) -> None:
    tables = [Table(VENUE, [replace(NONE, title=name)], [PD], 2, name=name) for name in ("one", "other")]
    with Workers(1) as pool:
        played = play(tables, Store(tmp_path), pool)
    assert (played.jobs, len(list(tmp_path.iterdir()))) == (1, 1)
    assert played.results[0, 0, 0] == played.results[1, 0, 0]


def test_fresh_plays_again_and_leaves_the_meetings_of_others(tmp_path: Path) -> None:
    other = meeting(VENUE.changed({"power_ratio": 1.3}))
    for each in (meeting(), other):
        Store(tmp_path).put(each, attempt(each))
    fresh = Store(tmp_path, fresh=True)
    assert fresh.get(meeting()) is None
    assert Store(tmp_path).get(other) is not None
    fresh.put(meeting(), attempt(meeting()))
    assert fresh.get(meeting()) is not None


def test_code_of_ones_own_that_changed_is_played_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    file, store = tmp_path / "own_policies.py", Store(tmp_path / "meetings")
    file.write_text(POLICY.format(1))
    mine = Contestant("mine", 'mixture?policies=["own_policies:Mine","none"]')
    assert set(meeting(attacker=mine).sources) == {"module:own_policies", "module:tests"}  # which it imports from
    assert "own_policies" not in sys.modules  # looked at, and not run
    store.put(meeting(attacker=mine), {"metrics": {"return": [1.0, 2.0]}, "cpu_s": 0.0})
    assert store.get(meeting(attacker=mine)) is not None
    file.write_text(POLICY.format(2))
    assert store.get(meeting(attacker=mine)) is None
    assert meeting().sources == {}


@pytest.mark.parametrize("name", PROBLEMS)
def test_problems_know_nothing_of_one_another(name: str) -> None:
    """Otherwise results that were kept for one would have to be forgotten when another changes."""
    others = "|".join(set(PROBLEMS) - {name})
    foreign = re.compile(rf"^ *(?:from|import) (?:cps_envs|cps_baselines)\.(?:{others})\b", re.MULTILINE)
    for package in (cps_envs, cps_baselines):
        files = list((Path(package.__path__[0]) / name).rglob("*.py"))
        assert files
        assert not [file for file in files if foreign.search(file.read_text())]
    assert len({fingerprint(each) for each in (*PROBLEMS, "elsewhere:PROBLEM")}) == len(PROBLEMS) + 1


KEPT: dict[str, Any] = {"metrics": {"return": [1.0, 2.0]}, "cpu_s": 0.1}


def edited(file: Path, change: str) -> str:
    """The text of a kept result after something happened to it."""
    text = file.read_text(encoding="utf-8")
    kept = json.loads(text)
    if change == "deep":
        return "[" * 100_000
    if change == "values":
        kept["result"]["metrics"]["return"] = [1e9, 1e9]
    elif change == "one value":
        kept["result"]["metrics"]["return"] = [1.0]
    elif change == "not a number":
        return text.replace("2.0", "NaN")
    elif change.startswith("forged"):  # with a digest that fits
        kept["result"]["metrics"]["return"] = FORGED[change]
        kept["digest"] = _digest(kept["result"])
    elif change == "another job":
        kept["job"]["attacker"] = "random"
    elif change == "no digest":
        del kept["digest"]
    elif change == "no result":
        del kept["result"]
    elif change == "half":
        return text[: len(text) // 2]
    else:
        return change
    return json.dumps(kept)


FORGED: dict[str, Any] = {
    "forged value": [float("nan")] * 3,
    "forged length": [1.0],
    "forged text": ["1", "2", "3"],
    "forged kind": 7,
}


@pytest.mark.parametrize(
    "change",
    [
        *FORGED,
        "values",
        "one value",
        "not a number",
        "another job",
        "no digest",
        "no result",
        "half",
        "deep",
        "",
        "[]",
        "null",
    ],
)
def test_a_result_that_was_changed_is_not_believed(tmp_path: Path, change: str) -> None:
    kept = Store(tmp_path)
    kept.put(meeting(), KEPT)
    assert kept.get(meeting()) == KEPT
    (file,) = tmp_path.glob("*.json")
    file.write_text(edited(file, change), encoding="utf-8")
    assert kept.get(meeting()) is None
