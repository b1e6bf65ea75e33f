from __future__ import annotations

import json
import os
import signal
from functools import partial
from pathlib import Path

import pytest

from cps_envs.fdi.config import A
from cps_envs.fdi.optima import CONSTANTS, from_text
from cps_envs.fdi.task import parse_task
from tests.agents import command_line
from tests.agents.test_locking import AGAIN, needs_signals, started, stopped, wait_for

SHORT = ("--preset", "paper", "--set", "horizon=12", "--jobs", "1")

certify = partial(command_line.succeeded, "certify", columns=120)
refusal = partial(command_line.refusal, "certify")


def test_table_file_and_going_on(tmp_path: Path) -> None:
    path = tmp_path / "optima.json"
    result = certify(*SHORT, "--task", "x4>4 x4>1", "--out", str(path))
    assert "2 tasks: 1 reachable with continuous injections, 1 with a known attack, 2 closed" in result.stdout
    assert "2 tasks solved, 0 known before" in result.stderr
    values, records = from_text(path.read_text())
    assert values == {name: {**vars(A), "horizon": 12}[name] for name in CONSTANTS}
    assert records[parse_task("x4>4", 4)].status == "proved"

    result = certify(*SHORT, "--task", "x4>4", "--task", "v4>4", "--out", str(path), "--json")
    assert "1 tasks solved, 1 known before" in result.stderr
    found = json.loads(result.stdout)
    assert {row["attacked"] for row in found["rows"]} == {"x4", "v4"}
    assert all(command.startswith("cps-envs") for command in found["commands"])
    assert len(from_text(path.read_text())[1]) == 3


def test_improving_keeps_the_better(tmp_path: Path) -> None:
    path = tmp_path / "optima.json"
    task = parse_task("xv4>4", 4)
    certify(*SHORT, "--task", "xv4>4", "--gap", "0.5", "--out", str(path))
    loose = from_text(path.read_text())[1][task]
    certify(*SHORT, "--task", "xv4>4", "--out", str(path))
    assert from_text(path.read_text())[1][task] == loose
    certify(*SHORT, "--task", "xv4>4", "--improve", "--out", str(path))
    tight = from_text(path.read_text())[1][task]
    assert tight.status == "proved"
    assert tight.bound_mps <= loose.bound_mps
    assert loose.value_mps is not None
    assert tight.value_mps is not None
    assert tight.value_mps >= loose.value_mps


@pytest.mark.parametrize("content", ["{}", "nonsense", None])
def test_files_of_something_else(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "optima.json"
    if content is None:
        certify(*SHORT, "--task", "x4>1", "--out", str(path))
    else:
        path.write_text(content)
    assert "--out" in refusal("--preset", "paper", "--set", "horizon=13", "--task", "x4>1", "--out", str(path))


@needs_signals
@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_interrupted_run_keeps_what_is_done(tmp_path: Path, jobs: str) -> None:
    path = tmp_path / "optima.json"
    with started("certify", "--preset", "paper", "--jobs", jobs, "--out", str(path)) as process:
        wait_for(lambda: path.exists() and len(from_text(path.read_text())[1]) >= 3, process)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        stopped(process, 130, AGAIN)
    assert len(from_text(path.read_text())[1]) >= 3


def test_episodes_with_drawn_starts_are_kept_and_not_done_again(tmp_path: Path) -> None:
    path = tmp_path / "episodes.json"
    short = ("--preset", "drawn", "--set", "horizon=20", "--set", "tasks=v4>4", "--jobs", "1", "--time-limit", "1")
    result = certify(*short, "--episodes", "1", "--out", str(path))
    assert "1 episodes solved, 0 known before" in result.stderr
    result = certify(*short, "--episodes", "2", "--out", str(path), "--json")
    assert "1 episodes solved, 1 known before" in result.stderr
    found = json.loads(result.stdout)
    assert set(found) == {"0", "1"}
    assert all(row["task"] == "v4>4" and row["bound_mps"] >= row["value_mps"] for row in found.values())
    other = (*short, "--set", "gap_spread_m=0.1", "--episodes", "1", "--out", str(path))
    assert "another configuration" in refusal(*other)
