"""The command line itself: what it lists, needs and survives; searches of numbers, and the stability of strings."""

from __future__ import annotations

import json
import os
from importlib.metadata import version
from pathlib import Path

import pytest

from cps_agents.commands.options import whole
from cps_agents.console import assignments
from cps_envs.core.game.problem import Problem
from tests.agents.command_line import invoke, refusal, succeeded

SHORT = ("--set", "duration_s=5")


def test_version() -> None:
    assert succeeded("--version").stdout.strip() == f"cps-envs {version('cps-envs')}"


def test_list_names_environments_and_policies() -> None:
    printed = succeeded("list", "disbanding").stdout
    shown = ("cps_envs:cps_envs/DisbandingAttack-v0", "swarm_env", "learning", "heuristic", "privileged: model")
    for name in (*shown, "Privileged: knows"):
        assert name in printed


def test_list_marks_policies_that_cannot_play_learning() -> None:
    printed = succeeded("list", "hvac", "disbanding").stdout
    for setting in ("paper", "paper with attack_budget=5"):
        assert f"(plays {setting}, not learning)" in " ".join(printed.split())


def test_list_as_json() -> None:
    (problem,) = (found for found in json.loads(succeeded("list", "--json").stdout) if found["name"] == "disbanding")
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
        assert "`cps-envs --trust ...`" in refusal(*arguments)
    if name.startswith("sb3:"):
        pytest.importorskip("stable_baselines3")
    for agreed in (invoke("--trust", *command), invoke(*command, "--trust")):
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


def test_values_of_set_are_json_or_text() -> None:
    given = ("a=1", "b=[0.1, 0.5]", "c=end", "d=true", "e=False", "f=x=y")
    assert assignments(given) == {"a": 1, "b": [0.1, 0.5], "c": "end", "d": True, "e": False, "f": "x=y"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["play"], "Problems: disbanding, fdi, hvac, rogue."),
        (["evaluate"], "Problems: disbanding, fdi, hvac, rogue."),
        (["evaluate", "rogue"], "Roles: attacker, defender."),
        (["train", "--steps", "1.5"], "'1.5' is not a whole number of at least 1"),
        (["train", "--steps", "many"], "such as 500000 or 5e5"),
    ],
)
def test_what_is_missing_or_no_number_is_said(arguments: list[str], said: str) -> None:
    assert said in " ".join(invoke(*arguments, columns=200).stderr.split())


def test_whole_numbers_may_be_written_as_people_write_them() -> None:
    assert [whole(text) for text in ("7", "1e6", "1_000", "2.5e3")] == [7, 1_000_000, 1_000, 2_500]
