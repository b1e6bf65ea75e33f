from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cps_agents.commands.string_stability import string_stability

matplotlib_image = pytest.importorskip("matplotlib.image")


def invoke_stability(*arguments: str) -> Any:
    alone = typer.Typer()
    alone.command()(string_stability)
    return CliRunner().invoke(alone, list(arguments), env={"COLUMNS": "130"})


def test_string_stability_prints_the_table_and_the_verdict(tmp_path: Path) -> None:
    target = tmp_path / "stability.png"
    result = invoke_stability("--plot", str(target))
    assert result.exit_code == 0
    assert "1.688  0.150    42 s" in result.stdout
    assert "contradicts section 2.2.1" in result.stdout
    assert matplotlib_image.imread(target).shape[1] > 1000


def test_string_stability_as_json() -> None:
    document = json.loads(invoke_stability("--json").stdout)
    assert len(document["peaks"]) == 14 * 5
    (peak,) = (row for row in document["peaks"] if (row["vehicles_per_platoon"], row["tau_s"]) == (10, 0.1))
    assert peak["gain"] == pytest.approx(1.69, abs=0.005)
    assert document["stable_sizes"]["0.5"] == []
