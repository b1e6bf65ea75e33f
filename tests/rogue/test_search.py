"""The search behind the attacker `switching`, and what it found."""

from __future__ import annotations

import json
from dataclasses import fields
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.reproduction.headroom import SHIPPED
from cps_baselines.rogue.switching_search import (
    ALL,
    DEFENDERS,
    RATIOS,
    SwitchingSearch,
    search_switching,
    switching_damages,
)
from tests.agents.command_line import invoke

pytest.importorskip("cma")
TINY = {"generations": 3, "population": 6, "restarts": 1, "worlds": 1, "finalists": 2, "final_worlds": 1}


def shipped() -> list[dict[str, Any]]:
    return json.loads(files("cps_baselines.rogue").joinpath("switching.json").read_text(encoding="utf-8"))["found"]


def test_a_search_is_repeatable_beats_full_throttle_and_leaves_numpy_alone() -> None:
    state = np.random.get_state()[1].copy()
    search = SwitchingSearch("pd", 1.0, **TINY)
    found = search_switching(search)
    assert found == search_switching(search)
    assert np.array_equal(np.random.get_state()[1], state)
    throttle = float(switching_damages(np.zeros((1, 7)), search, [0], spread=0.0).mean())
    assert throttle == pytest.approx(4.5, abs=0.2)
    assert min(found["damage"], found["verified"]) > 2 * throttle
    assert json.loads(json.dumps(found["search"])) == {**vars(search), "start": []}


def test_a_run_can_start_at_weights() -> None:
    start = tuple(next(row["weights"] for row in shipped() if row["against"] == ALL and row["power_ratio"] == 1.0))
    cold = SwitchingSearch("sliding_detection", 1.0, **TINY)
    warm = SwitchingSearch("sliding_detection", 1.0, **TINY, start=start)
    assert (cold.runs, warm.runs) == (1, 2)
    assert search_switching(warm)["verified"] > 2 * search_switching(cold)["verified"]


def test_against_all_means_the_mean_over_the_six_defenders() -> None:
    weights = np.array([[1.34, 0.16, -0.69, 4.35, -0.14, -0.47, -0.71]])
    together = switching_damages(weights, SwitchingSearch(ALL, 1.3), [0], spread=0.0)[0, :, 0]
    for defender, damage in zip(DEFENDERS, together, strict=True):
        alone = switching_damages(weights, SwitchingSearch(defender, 1.3), [0], spread=0.0)
        assert alone.ravel() == pytest.approx(damage, abs=1e-9)
    assert together[0] == pytest.approx(120.6, abs=0.06)  # the check value of the specification


def test_the_shipped_file_is_complete_and_says_how_it_was_found() -> None:
    rows = shipped()
    assert [(row["against"], row["power_ratio"]) for row in rows] == [
        (name, ratio) for name in (ALL, *DEFENDERS) for ratio in RATIOS
    ]
    default = json.loads(json.dumps(vars(SwitchingSearch(ALL, 1.0))))
    for row in rows:
        assert set(row["search"]) == {field.name for field in fields(SwitchingSearch)}
        changed = {name for name, value in row["search"].items() if value != default[name]}
        assert changed <= {"against", "power_ratio", "start"}
        general = next(each for each in rows if (each["against"], each["power_ratio"]) == (ALL, row["power_ratio"]))
        assert row["search"]["start"] == ([] if row["against"] == ALL else general["weights"])


@pytest.mark.parametrize("row", shipped(), ids=lambda row: f"{row['against']}-{row['power_ratio']}")
def test_the_shipped_weights_do_what_the_file_says(row: dict[str, Any]) -> None:
    search = SwitchingSearch(row["against"], row["power_ratio"])
    found = switching_damages(np.array([row["weights"]]), search, [0], spread=0.0).mean()
    assert found == pytest.approx(row["damage"], rel=0.05)


def test_they_reach_what_another_search_found() -> None:
    """The bar: the best of three cross-entropy searches of an independent implementation, verified as ours is."""
    bars = {(row["defender"], float(row["power_ratio"])): float(row["verified"]) for row in SHIPPED}
    for row in shipped():
        if row["against"] != ALL:
            assert row["verified"] >= 0.95 * bars[row["against"], row["power_ratio"]], row["against"]


def test_the_command_writes_what_it_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "found.json"
    sizes = ["--generations", "1", "--population", "4", "--restarts", "1", "--jobs", "1"]
    arguments = ["search-switching", "--against", "pd", "--ratio", "1.3", *sizes, "--out", str(target)]
    result = invoke(*arguments)
    assert result.exit_code == 0, result.output
    (found,) = json.loads(target.read_text())["found"]
    assert (found["against"], found["power_ratio"]) == ("pd", 1.3)
    assert len(found["search"]["start"]) == 7
    assert str(target) in result.stderr
