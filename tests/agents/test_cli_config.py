"""A system of one's own on the command line: `--config FILE.toml`, recordings, and recorded attacks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cps_agents.cli import whole
from tests.agents.command_line import invoke, refusal, succeeded

HOUSE = """
problem = "hvac"
preset = "paper"
[fields]
num_steps = 230
onset_step = 0
"""
PLAYED = ("play", "hvac", "--attacker", "random", "--defender", "none", "--json")


@pytest.fixture
def house(tmp_path: Path) -> str:
    (tmp_path / "house.toml").write_text(HOUSE, encoding="utf-8")
    return str(tmp_path / "house.toml")


def test_every_command_that_takes_set_takes_a_file() -> None:
    taking = {
        name: {option for parameter in command.params for option in parameter.opts}
        for name, command in whole().commands.items()
    }
    assert {name for name, options in taking.items() if "--set" in options and "--config" not in options} == set()
    assert sum("--set" in options for options in taking.values()) >= 9


def test_set_wins_over_the_file(house: str) -> None:
    found = json.loads(succeeded(*PLAYED, "--config", house, "--set", "num_steps=240").stdout)
    assert (found["preset"], found["config"]["num_steps"], found["config"]["onset_step"]) == ("paper", 240, 0)


def test_a_file_is_written_that_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "new.toml").write_text(
        succeeded("list", "hvac", "--config", "--preset", "paper").stdout, encoding="utf-8"
    )
    few = ("--set", "num_steps=230")
    written = json.loads(succeeded(*PLAYED, "--config", str(tmp_path / "new.toml"), *few).stdout)
    usual = json.loads(succeeded(*PLAYED, "--preset", "paper", *few).stdout)
    assert written["config"] == usual["config"]


def test_another_payoff_is_printed_and_says_what_no_longer_holds(house: str) -> None:
    weights = ("--set", 'payoff={"a_impact": 1, "energy_kwh": 0.1}')
    result = succeeded(*PLAYED[:-1], "--config", house, *weights)
    assert "The return is the attacker's: a_impact + 0.1 energy_kwh." in result.stdout
    assert "certified bounds, frozen scores" in " ".join(result.stderr.split())
    found = json.loads(succeeded(*PLAYED, "--config", house, *weights).stdout)["episodes"][0]
    assert found["return"] == pytest.approx(found["a_impact"] + 0.1 * found["energy_kwh"])


def test_wrong_files_are_refused(house: str, tmp_path: Path) -> None:
    assert "for the problem 'hvac', not for 'rogue'" in refusal("play", "rogue", "--config", house)
    assert "cannot be read" in refusal("play", "hvac", "--config", str(tmp_path / "none.toml"))
    assert "the preset 'paper', and 'easy'" in refusal("play", "hvac", "--config", house, "--preset", "easy")
    assert "is for one problem" in refusal("list", "--config")
    assert "goes with --config" in refusal("list", "hvac", "--preset", "easy")
    (tmp_path / "fdi.toml").write_text(
        'problem = "fdi"\npreset = "paper"\npayoff = { time_s = 1.0 }\n', encoding="utf-8"
    )
    assert "certificates are of the impact speed" in invoke("certify", "--config", str(tmp_path / "fdi.toml")).stderr
    assert "name what is certified" in refusal("certify")


def test_an_episode_is_recorded_and_played_again(house: str, tmp_path: Path) -> None:
    path = tmp_path / "episode.csv.gz"
    first = json.loads(succeeded(*PLAYED, "--config", house, "--seed", "3", "--record", str(path)).stdout)
    again = ("--attacker", f"trace?file={path}", "--defender", "none", "--seed", "3", "--json")
    second = json.loads(succeeded("play", "hvac", "--config", house, *again).stdout)
    assert second["episodes"][0] == pytest.approx(first["episodes"][0], rel=1e-9)
    assert "ends in .csv, .csv.gz, .parquet" in refusal(*PLAYED, "--record", "episode.txt")
    assert "leave one of them out" in refusal(*PLAYED, "--record", "episode.csv", "--render", "episode.gif")


def test_a_detector_is_judged_on_a_recorded_attack(house: str, tmp_path: Path) -> None:
    (tmp_path / "attack.csv").write_text("time_s,attacker_bias_c_1\n0,-3\n27480,-3\n", encoding="utf-8")
    judged = ("evaluate", "hvac", "defender", "--defender", "always?action=0", "--config", house, "--episodes", "2")
    against = ("--attacker", f"trace?file={tmp_path / 'attack.csv'}", "--meetings", str(tmp_path), "--json")
    [standing] = json.loads(succeeded(*judged, *against).stdout)["standings"]
    assert standing["opponent"] == f"trace?file={tmp_path / 'attack.csv'}"


def test_a_shipped_network_that_does_not_fit_says_what_it_would_need(house: str) -> None:
    assert "set kalman_filters=true" in refusal("play", "hvac", "--config", house, "--defender", "zoo:hvac-defense")
