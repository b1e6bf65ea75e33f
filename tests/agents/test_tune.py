"""Studies over the knobs of a recipe."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.agents.command_line import invoke

pytest.importorskip("optuna")
pytest.importorskip("torch")


RECIPE = "fdi-attack"
SMALL = "num_envs=2 steps_per_update=16 batch_size=16 evaluations=1 evaluation_episodes=1 opponent=none"


def tune(folder: Path, *arguments: str) -> Any:
    knobs = [part for knob in SMALL.split() for part in ("--knob", knob)]
    short = ("--set", "attack_share=1", "--steps", "32", "--out", str(folder), "--jobs", "1")
    return invoke("tune", RECIPE, *short, *knobs, *arguments)


def test_a_study_goes_on_where_it_stopped(tmp_path: Path) -> None:
    ranges = ["--range", "learning_rate=1e-4:1e-2:log", "--range", "hidden=[8,8]|[4,4]", "--range", "epochs=1:2"]
    first = tune(tmp_path, *ranges, "--trials", "1", "--json")
    assert first.exit_code == 0, first.output
    more = tune(tmp_path, *ranges, "--trials", "3")
    assert more.exit_code == 0, more.output
    assert "Train it: cps-envs train fdi-attack --knob" in more.output
    found = json.loads(tune(tmp_path, *ranges, "--trials", "3", "--json").stdout)
    assert [row["number"] for row in found] == [0, 1, 2]
    assert found[0] == json.loads(first.stdout)[0]
    assert len({row["values"]["learning_rate"] for row in found}) == 3  # nothing is drawn twice after an interruption
    assert all(1e-4 <= row["values"]["learning_rate"] <= 1e-2 for row in found)
    other = tune(tmp_path, "--range", "epochs=1:3", "--trials", "4")
    assert (other.exit_code, "another --out" in other.output) == (2, True)


def test_a_trial_that_cannot_train_is_said(tmp_path: Path) -> None:
    result = tune(tmp_path, "--range", "discount=0.9|1.5", "--sampler-seed", "0", "--trials", "1")
    assert result.exit_code == 2
    assert "Trial 0 failed: discount has to lie in (0, 1]" in result.output
    assert "none of the last" in result.output
