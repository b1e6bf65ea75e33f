"""The command line itself: what it lists, needs and survives; searches of numbers, and the stability of strings."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cps_agents.console import assignments
from cps_envs.core.problem import Problem
from cps_paper.commands.string_stability import string_stability
from tests.agents.command_line import invoke

SHORT = ("--set", "duration_s=5")


def test_version() -> None:
    result = invoke("--version")
    assert (result.exit_code, result.stdout.strip()) == (0, f"cps-envs {version('cps-envs')}")


def test_the_command_line_itself_imports_nothing_heavy() -> None:
    heavy = "{'torch', 'numba', 'numpy', 'gymnasium', 'matplotlib', 'cps_envs'}"
    code = f"import sys, cps_agents.cli; print(sorted({heavy} & set(sys.modules)))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.strip() == "[]"


def test_no_command_imports_torch() -> None:
    code = (
        "import sys; from typer.testing import CliRunner; from cps_agents.cli import app\n"
        "for line in ('list', 'play disbanding --set duration_s=2'):\n"
        "    assert CliRunner().invoke(app, line.split()).exit_code == 0\n"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_list_names_environments_and_policies() -> None:
    result = invoke("list", "disbanding")
    assert result.exit_code == 0
    for name in (
        "cps_envs:cps_envs/DisbandingAttack-v0",
        "swarm_env",
        "learning",
        "heuristic",
        "told: model",
        "Told: knows",
    ):
        assert name in result.stdout


def test_list_as_json() -> None:
    (problem,) = (found for found in json.loads(invoke("list", "--json").stdout) if found["name"] == "disbanding")
    policies = {role: {entry["name"]: entry for entry in found} for role, found in problem["policies"].items()}
    assert problem["gymnasium"]["defender"] == "cps_envs:cps_envs/DisbandingDefense-v0"
    assert problem["pettingzoo"]["swarm"] == "cps_envs.disbanding_v0.swarm_env"
    assert policies["attacker"]["ga"]["privileged"] == ["model", "opponent"]
    assert policies["attacker"]["lead"]["summary"].startswith("Disbands the lead platoon")
    assert all(entry["missing"] or entry["summary"] for found in policies.values() for entry in found.values())


@pytest.mark.parametrize("name", ["tests.core.toy_policies:Chase", "sb3:{}"])
def test_code_runs_only_with_consent(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CPS_ENVS_TRUST", "0")  # put back afterwards
    model = tmp_path / "model.zip"
    model.write_bytes(b"no model")
    command = ("play", "disbanding", *SHORT, "--defender", name.format(model))
    for arguments in (
        command,
        ("evaluate", "disbanding", "defender", "--defender", name.format(model), "--episodes", "1"),
    ):
        refused = invoke(*arguments)
        assert refused.exit_code == 2
        assert "`cps-envs --trust ...`" in " ".join(refused.stderr.split())
    if name.startswith("sb3:"):
        pytest.importorskip("stable_baselines3")
    agreed = invoke("--trust", *command)
    assert "--trust" not in agreed.stderr
    assert agreed.exit_code != 0  # neither plays this problem
    assert os.environ["CPS_ENVS_TRUST"] == "1"  # for workers


def test_debug_shows_where_an_error_comes_from() -> None:
    result = invoke("--debug", "play", "disbandin")
    assert result.exit_code == 1
    assert isinstance(result.exception, LookupError)


def test_faults_of_the_program_are_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(problem: Problem) -> None:
        raise KeyError("a fault")

    monkeypatch.setattr("cps_agents.commands.list.describe_problem", broken)
    assert isinstance(invoke("list", "hvac").exception, KeyError)


def test_an_interrupt_gives_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(problem: Problem) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("cps_agents.commands.list.describe_problem", interrupted)
    result = invoke("list", "hvac")
    assert (result.exit_code, result.stdout) == (130, "")
    assert "Interrupted" in result.stderr


def test_values_of_set_are_json_or_text() -> None:
    given = ("a=1", "b=[0.1, 0.5]", "c=end", "d=true", "e=False", "f=x=y")
    assert assignments(given) == {"a": 1, "b": [0.1, 0.5], "c": "end", "d": True, "e": False, "f": "x=y"}


def invoke_stability(*arguments: str) -> Any:
    alone = typer.Typer()
    alone.command()(string_stability)
    return CliRunner().invoke(alone, list(arguments), env={"COLUMNS": "130"})


def test_string_stability_prints_the_table_and_the_verdict(tmp_path: Path) -> None:
    matplotlib_image = pytest.importorskip("matplotlib.image")
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
