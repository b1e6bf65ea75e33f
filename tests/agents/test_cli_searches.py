"""The commands that search the numbers of disbanding defenders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.agents.command_line import invoke


def test_search_string_goes_on_from_a_result(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    module = pytest.importorskip("cps_baselines.disbanding.string_search")

    def fake(search: Any, report: Any, start: Any) -> dict[str, Any]:
        report(search.trials // 2, {"cost": 2.0})
        return {"cost": 1.0, "form": search.form, "begun": start and start.detection_mps.tolist()}

    monkeypatch.setattr(module, "search_string", fake)
    earlier, target = tmp_path / "earlier.json", tmp_path / "new" / "string.json"
    earlier.write_text(json.dumps({"gains": [[0.0] * 16] * 2, "detection_mps": 1.5}))
    arguments = ("search-string", "--form", "local", "--trials", "4")
    assert invoke(*arguments, "--start", str(earlier), "--out", str(target)).exit_code == 0
    assert json.loads(target.read_text()) == {"cost": 1.0, "form": "local", "begun": [1.5]}
    assert json.loads(invoke(*arguments).stdout)["begun"] is None


def test_search_feedback_writes_its_result(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    module = pytest.importorskip("cps_baselines.disbanding.feedback_search")

    def fake(search: Any, report: Any) -> dict[str, Any]:
        report(search.trials // 2, {"cost": 2.0})
        if search.seed == 13:
            raise KeyboardInterrupt
        return {"weights": [[0.0]], "cost": 1.0, "seed": search.seed}

    monkeypatch.setattr(module, "search_feedback", fake)
    target = tmp_path / "new" / "weights.json"
    assert invoke("search-feedback", "--trials", "4", "--seed", "7", "--out", str(target)).exit_code == 0
    assert json.loads(target.read_text())["seed"] == 7
    assert json.loads(invoke("search-feedback", "--trials", "4").stdout)["cost"] == 1.0
    assert invoke("search-feedback", "--seed", "13", "--out", str(target)).exit_code == 130
    assert json.loads(target.read_text())["cost"] == 2.0  # the best so far is kept
