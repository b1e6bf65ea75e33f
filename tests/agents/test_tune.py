"""Studies over the knobs of a recipe."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.agents.command_line import refusal, succeeded

pytest.importorskip("optuna")
pytest.importorskip("torch")


RECIPE = "fdi-attack"
SMALL = "num_envs=2 steps_per_update=16 batch_size=16 evaluations=1 evaluation_episodes=1 opponent=none"


def tune(folder: Path, *arguments: str) -> tuple[str, ...]:
    """The words of a small study."""
    knobs = [part for knob in SMALL.split() for part in ("--knob", knob)]
    short = ("--set", "attack_share=1", "--steps", "32", "--out", str(folder), "--jobs", "1")
    return ("tune", RECIPE, *short, *knobs, *arguments)


def test_a_study_goes_on_where_it_stopped(tmp_path: Path) -> None:
    ranges = ["--range", "learning_rate=1e-4:1e-2:log", "--range", "hidden=[8,8]|[4,4]", "--range", "epochs=1:2"]
    (first,) = json.loads(succeeded(*tune(tmp_path, *ranges, "--trials", "1", "--json")).stdout)
    more = succeeded(*tune(tmp_path, *ranges, "--trials", "3"))
    assert "Train it: cps-envs train fdi-attack --knob" in more.output
    found = json.loads(succeeded(*tune(tmp_path, *ranges, "--trials", "3", "--json")).stdout)
    assert [row["number"] for row in found] == [0, 1, 2]
    assert found[0] == first
    assert len({row["values"]["learning_rate"] for row in found}) == 3  # nothing is drawn twice after an interruption
    assert all(1e-4 <= row["values"]["learning_rate"] <= 1e-2 for row in found)
    assert "another --out" in refusal(*tune(tmp_path, "--range", "epochs=1:3", "--trials", "4"))


def test_a_trial_that_cannot_train_is_said(tmp_path: Path) -> None:
    told = refusal(*tune(tmp_path, "--range", "discount=0.9|1.5", "--sampler-seed", "0", "--trials", "1"))
    assert "Trial 0 failed: discount has to lie in (0, 1]" in told
    assert "none of the last" in told
