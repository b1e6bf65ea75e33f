from __future__ import annotations

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from agents.bench import faces, suite
from agents.bench.clock import calls_per_s
from agents.bench.suite import measure_all
from agents.cli import app
from cps_envs import find_problem

PROBLEM = find_problem("disbanding")


@pytest.fixture
def few_envs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faces, "NUM_ENVS", (1, 2))
    monkeypatch.setattr(suite, "KERNEL_LANES", (1,))


def test_calls_are_counted_by_cpu_time() -> None:
    calls = []
    rate = calls_per_s(lambda: calls.append(sum(range(20_000))), 0.03)
    assert 100 < rate < 1e6
    assert len(calls) > 3


@pytest.mark.usefixtures("few_envs")
def test_everything_is_measured() -> None:
    reports: list[tuple[int, int, str]] = []
    found = measure_all([PROBLEM], 0.01, lambda *report: reports.append(report))
    measured = {(speed.env, speed.form, speed.envs) for speed in found["speeds"]}
    assert ("CartPole-v1", "vector", 2) in measured
    assert ("cps_envs/DisbandingAttack-v0", "single", 1) in measured
    assert ("cps_envs/disbanding-v0", "parallel", 1) in measured
    assert reports[-1][0] == reports[-1][1] == len(found["speeds"]) + 1 + 2
    for speed in found["speeds"]:
        assert speed.steps_per_s > 0
        ours = speed.env != "CartPole-v1"
        assert (speed.work_per_s > 0) == ours
        assert speed.cartpole_ratio > 0 if ours else speed.cartpole_ratio == 1


def test_work_is_counted_per_decision() -> None:
    attack, duel = (next(face for face in faces.faces(PROBLEM) if face.form == form) for form in ("single", "parallel"))
    assert (attack.work, duel.work) == (100 * 100, 100 * 10)
    assert duel.decisions == pytest.approx(1.1)


@pytest.mark.usefixtures("few_envs")
def test_the_command_prints_whether_targets_are_met() -> None:
    result = CliRunner().invoke(app, ["bench", "--seconds", "0.01", "--json"])
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    assert {"machine", "speeds", "physics", "added", "targets"} <= set(found)
    for target in found["targets"]:
        bound = float(target["wanted"].split()[-1].replace(",", ""))
        reached = target["measured"] >= bound if "at least" in target["wanted"] else target["measured"] < bound
        assert target["met"] == reached
    printed = CliRunner().invoke(app, ["bench", "--seconds", "0.01"]).stdout
    assert "CartPole" in printed
    assert "Targets" in printed
