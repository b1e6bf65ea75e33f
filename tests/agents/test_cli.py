from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_agents.console import assignments
from cps_agents.files import replacing, write_text

SHORT = ("--set", "duration_s=5")
COMMANDS = tuple(typer.main.get_command(app).commands)  # type: ignore[attr-defined]


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, list(arguments), env={"COLUMNS": "100", "TERMINAL_WIDTH": "100"})


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS)])
def test_help(command: Sequence[str]) -> None:
    result = invoke(*command, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.stdout


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
    result = invoke("list")
    assert result.exit_code == 0
    for name in ("cps_envs:cps_envs/DisbandingAttack-v0", "swarm_env", "learning", "heuristic", "oracle: model"):
        assert name in result.stdout


def test_list_as_json() -> None:
    (problem,) = (found for found in json.loads(invoke("list", "--json").stdout) if found["name"] == "disbanding")
    policies = {role: {entry["name"]: entry for entry in found} for role, found in problem["policies"].items()}
    assert problem["gymnasium"]["defender"] == "cps_envs:cps_envs/DisbandingDefense-v0"
    assert problem["pettingzoo"]["swarm"] == "cps_envs.disbanding_v0.swarm_env"
    assert policies["attacker"]["ga"]["privileged"] == ["model", "opponent"]
    assert policies["attacker"]["lead"]["summary"].startswith("The optimal single attack")
    assert all(entry["missing"] or entry["summary"] for found in policies.values() for entry in found.values())


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("play", "disbandin"), "Did you mean 'disbanding'?"),
        (("play", "disbanding", "--attacker", "leed"), "Did you mean 'lead'?"),
        (("play", "disbanding", "--preset", "papr"), "Did you mean 'paper'?"),
        (("play", "disbanding", "--set", "tau=1"), "Did you mean 'tau_s'?"),
        (("play", "disbanding", "--set", "tau_s"), "field=value"),
        (("play", "disbanding", "--set", "tau_s=9"), "[0.01, 2] s; the default is 0.1"),
        (("play", "disbanding", "--attacker", "plan"), "events"),
        (("play", "disbanding", "--attacker", "lead?when=3"), "when"),
        (("play", "disbanding", "--attacker", "every_other"), "attack_budget=5"),
        (("play", "disbanding", "--defender", "nowhere:Policy"), "nowhere"),
        (("play", "disbanding", "--render", "film.avi"), "FILE.mp4"),
        (("play", "disbanding", "--render", "film.gif", "--at", "3"), "--render FILE.png"),
        (("play", "disbanding", "--render", "film.png", "--at", "999"), "180 s"),
        (("play", "disbanding", "--render", "film.mp4", "--fps", "0"), "above 0"),
        (("play", "disbanding", "--episodes", "0"), "greater than or equal to 1"),
        (("benchmark", "disbandin"), "Did you mean 'disbanding'?"),
        (("benchmark", "--table", "tau-0.4"), "tau-0."),
        (("benchmark", "disbanding", "--attacker", "leed"), "Did you mean 'lead' or 'learned'?"),
        (("benchmark", "--defender", "heuristics"), "Did you mean 'heuristic'?"),
        (("bench", "--problem", "disbandin"), "Did you mean 'disbanding'?"),
    ],
)
def test_wrong_input_gets_one_message_that_names_the_remedy(arguments: Sequence[str], remedy: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert remedy in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("name", ["tests.core.toy_policies:Chase", "sb3:{}"])
def test_code_runs_only_with_consent(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CPS_ENVS_TRUST", "0")  # put back afterwards
    model = tmp_path / "model.zip"
    model.write_bytes(b"no model")
    command = ("play", "disbanding", *SHORT, "--defender", name.format(model))
    for arguments in (
        command,
        ("evaluate", "disbanding", "defender", "--policy", name.format(model), "--episodes", "1"),
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
    def broken() -> None:
        raise KeyError("a fault")

    monkeypatch.setattr("cps_agents.catalogue.describe_everything", broken)
    assert isinstance(invoke("list").exception, KeyError)


def test_an_interrupt_gives_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("cps_agents.catalogue.describe_everything", interrupted)
    result = invoke("list")
    assert (result.exit_code, result.stdout) == (130, "")
    assert "Interrupted" in result.stderr


def test_a_missing_package_is_told_with_its_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "imageio.v2", None)
    result = invoke("play", "disbanding", *SHORT, "--render", str(tmp_path / "film.png"))
    assert result.exit_code == 2
    assert 'pip install "cps-envs[render]"' in result.stderr
    assert not list(tmp_path.iterdir())


def test_values_of_set_are_json_or_text() -> None:
    given = ("a=1", "b=[0.1, 0.5]", "c=end", "d=true", "e=False", "f=x=y")
    assert assignments(given) == {"a": 1, "b": [0.1, 0.5], "c": "end", "d": True, "e": False, "f": "x=y"}


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "file.txt"
    target.write_text("old")

    def write_half() -> None:
        with replacing(target) as draft:
            draft.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_is_being_written_is_seen_by_nobody(tmp_path: Path) -> None:
    target = tmp_path / "card.json"
    with replacing(target) as draft:
        draft.write_text("{")
        assert draft.suffix == ".json"  # which writers of pictures go by
        assert list(tmp_path.glob("*.json")) == []
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "folder").write_text("a file where a folder is needed")
    target = tmp_path / "folder" / "file.txt"
    with pytest.raises(OSError, match=r"folder/file\.txt"), replacing(target) as draft:
        draft.write_text("never")
    full = tmp_path / "full.txt"
    with pytest.raises(OSError, match=r"cannot be written: No space left on device.*full\.txt"), replacing(full):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert not full.exists()


def test_errors_about_other_files_stay_as_they_are(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"other\.txt"), replacing(tmp_path / "file.txt"):
        (tmp_path / "other.txt").read_text()


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


def test_writers_in_one_folder_do_not_disturb_one_another(tmp_path: Path) -> None:
    def write(place: int) -> None:
        for _ in range(200):
            write_text(tmp_path / f"{place}.txt", "whole\n")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(4)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.txt", "1.txt", "2.txt", "3.txt"]
