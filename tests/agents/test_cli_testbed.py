from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_envs.core.play import play_episodes
from cps_envs.testbed.problem import TESTBED

EARLY = "plan?events=[[3, 5]]"
SHORT = ("--set", "duration_s=12", "--set", "measured_from_s=5", "--set", "measured_for_s=5", "--attacker", EARLY)


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, list(arguments), env={"COLUMNS": "120"})


def test_a_defender_s_episodes_are_those_of_the_game() -> None:
    result = invoke("testbed", *SHORT, "--defender", "feedback", "--seed", "3", "--episodes", "2", "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    config = TESTBED.config("paper", {"duration_s": 12, "measured_from_s": 5, "measured_for_s": 5})
    expected = play_episodes(TESTBED, config, {"attacker": EARLY, "defender": "feedback"}, (3, 4))
    assert [episode["velocity_error"] for episode in found["episodes"]] == expected["velocity_error"].tolist()
    assert found["preset"] == "paper"


def test_the_paper_s_mitigation_by_its_period() -> None:
    found = json.loads(invoke("testbed", *SHORT, "--period", "0.5", "--json").stdout)
    assert "horizon_s=0.5" in found["defender"]
    assert found["config"]["avoidance"] == "until_disbanding"
    usual = json.loads(invoke("testbed", *SHORT, "--json").stdout)
    assert usual["defender"] == "none"
    assert usual["episodes"] != found["episodes"]


def test_the_table_names_the_error() -> None:
    result = invoke("testbed", *SHORT, "--episodes", "2")
    assert result.exit_code == 0
    assert "velocity_error" in result.stdout
    assert "2 episodes" in result.stdout


@pytest.mark.parametrize("kind", ["gif", "mp4", "png"])
def test_the_animation_is_written(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v3")
    if kind == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    file = tmp_path / f"robots.{kind}"
    result = invoke("testbed", *SHORT, "--period", "1", "--render", str(file), "--fps", "2", "--speed", "4")
    assert result.exit_code == 0, result.output
    frames = list(imageio.imiter(file))
    assert len(frames) == (1 if kind == "png" else 7)
    assert np.asarray(frames[0]).shape[:2] == (540, 960)


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--period", "0.5", "--defender", "copy"), "give one of them"),
        (("--period", "0.52"), "multiple of sample_s"),
        (("--defender", "heuristics"), "heuristic"),
        (("--set", "radius_m=0.4"), "larger radius_m"),
    ],
)
def test_wrong_input_names_the_remedy(arguments: Sequence[str], remedy: str) -> None:
    result = invoke("testbed", *arguments)
    assert result.exit_code == 2
    assert remedy in " ".join(result.stderr.split())
