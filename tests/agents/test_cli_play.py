"""`cps-envs play`, of a problem and of one beside them: the episodes of the game, tables, pictures, films."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from cps_envs import find_problem
from cps_envs.core.game.play import play_episodes
from cps_paper.testbed.robots.problem import TESTBED
from tests.agents.command_line import refusal, succeeded

SHORT = ("--preset", "paper", "--set", "duration_s=5", "--set", "num_platoons=3")
EARLY = "plan?events=[[3, 5]]"
ROBOTS = "cps_paper.testbed.robots.problem:TESTBED"
FEW = ("--set", "duration_s=12", "--set", "measured_from_s=5", "--set", "measured_for_s=5", "--attacker", EARLY)


def play(*arguments: str) -> Any:
    return succeeded("play", "disbanding", *SHORT, *arguments)


def robots(*arguments: str) -> Any:
    return succeeded("play", ROBOTS, *FEW, *arguments)


def test_episodes_are_those_of_the_game() -> None:
    found = json.loads(
        play("--attacker", "random", "--defender", "none", "--seed", "3", "--episodes", "4", "--json").stdout
    )
    problem = find_problem("disbanding")
    config = problem.config("paper", {"duration_s": 5, "num_platoons": 3})
    expected = play_episodes(problem, config, {"attacker": "random", "defender": "none"}, range(3, 7))
    assert [episode["seed"] for episode in found["episodes"]] == [3, 4, 5, 6]
    for name, values in expected.items():
        assert [episode[name] for episode in found["episodes"]] == values.tolist()
        assert found["mean"][name] == pytest.approx(values.mean())
    assert found["config"]["num_platoons"] == 3


def test_a_defender_s_episodes_on_the_test_bed_are_those_of_the_game() -> None:
    found = json.loads(robots("--defender", "feedback", "--seed", "3", "--episodes", "2", "--json").stdout)
    config = TESTBED.config("paper", {"duration_s": 12, "measured_from_s": 5, "measured_for_s": 5})
    expected = play_episodes(TESTBED, config, {"attacker": EARLY, "defender": "feedback"}, (3, 4))
    assert [episode["velocity_error"] for episode in found["episodes"]] == expected["velocity_error"].tolist()
    assert found["preset"] == "paper"


def test_a_problem_without_ids_is_listed_with_its_presets() -> None:
    assert "paper, mitigated" in succeeded("list", ROBOTS).stdout


def test_the_paper_s_mitigation_has_a_preset() -> None:
    found, usual = (json.loads(robots(*more, "--json").stdout) for more in (("--preset", "mitigated"), ()))
    assert "horizon_s=0.5" in found["defender"]
    assert found["config"]["avoidance"] == "until_disbanding"
    assert usual["defender"] == "none"
    assert usual["episodes"] != found["episodes"]


def test_the_preset_s_own_players_play_by_default() -> None:
    found = json.loads(play("--json").stdout)
    assert (found["attacker"], found["defender"]) == ("lead", "none")


def test_the_table_shows_every_metric_and_the_mean() -> None:
    printed = play("--episodes", "12").stdout
    assert "seed 11" in printed
    assert "12 episodes" in printed
    assert "velocity_error_intact" in printed
    assert "velocity_error_all + collision_penalty + end_charge" in " ".join(printed.split())
    printed = robots("--episodes", "2").stdout
    assert "velocity_error" in printed
    assert "2 episodes" in printed


def test_pictures_are_of_the_chosen_moment(tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v3")
    pictures = []
    for moment in ("0", "5"):
        file = tmp_path / f"at_{moment}.png"
        play("--render", str(file), "--at", moment)
        pictures.append(imageio.imread(file))
    play("--render", str(tmp_path / "end.PNG"))
    assert not np.array_equal(*pictures)
    assert np.array_equal(pictures[1], imageio.imread(tmp_path / "end.PNG"))


def test_a_picture_as_svg_needs_no_pygame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    pictures = []
    for moment in ("0", "5"):
        file = tmp_path / f"at_{moment}.svg"
        play("--render", str(file), "--at", moment)
        pictures.append(ElementTree.parse(file).getroot())
    assert [picture.get("viewBox") for picture in pictures] == ["0 0 960 540"] * 2
    assert "5.0 s" in [text.text for text in pictures[1].iter("{http://www.w3.org/2000/svg}text")]


@pytest.mark.parametrize("kind", ["gif", "mp4"])
def test_films_have_a_frame_every_second_and_leave_nothing_else(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v3")
    if kind == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    file = tmp_path / "films" / f"film.{kind}"
    play("--render", str(file), "--fps", "10", "--speed", "10", "--episodes", "2")
    assert len(list(imageio.imiter(file))) == 6
    assert list(file.parent.iterdir()) == [file]


def test_the_test_bed_is_shown(tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v3")
    file = tmp_path / "robots.gif"
    robots("--preset", "mitigated", "--render", str(file), "--fps", "2", "--speed", "4")
    frames = list(imageio.imiter(file))
    assert len(frames) == 7
    assert np.asarray(frames[0]).shape[:2] == (540, 960)


def test_rendering_changes_no_metric(tmp_path: Path) -> None:
    pytest.importorskip("imageio")
    arguments = ("--attacker", "random", "--defender", "copy", "--episodes", "2", "--json")
    plain = json.loads(play(*arguments).stdout)
    shown = json.loads(play(*arguments, "--render", str(tmp_path / "film.gif"), "--speed", "3").stdout)
    for before, after in zip(plain["episodes"], shown["episodes"], strict=True):
        assert after == pytest.approx(before, rel=1e-12)


def test_a_terminated_episode_is_shown_to_its_end(tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v3")
    crash = ("--set", "tau_s=0.5", "--set", "on_collision=end", "--set", "duration_s=20")
    file = tmp_path / "film.gif"
    found = json.loads(play(*crash, "--render", str(file), "--json").stdout)["episodes"][0]
    assert found["first_collision_s"] > 0
    assert len(list(imageio.imiter(file))) == int(np.ceil(found["first_collision_s"])) + 1


def test_human_rendering_needs_no_display_with_a_dummy_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    play("--render", "human", "--speed", "100")


def test_no_display_is_told_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame")

    def without_display(*_: Any) -> None:
        raise pygame.error("No available video device")

    monkeypatch.setattr("cps_envs.core.picture.rendering.Window.show", without_display)
    assert "--render FILE.mp4" in refusal("play", "disbanding", *SHORT, "--render", "human")


def test_what_is_paid_has_the_unit_of_the_configuration() -> None:
    rogue, fdi = find_problem("rogue"), find_problem("fdi")
    for problem, preset, changes, unit in (
        (rogue, "paper", {}, "m"),
        (rogue, "learning", {}, "m/s"),
        (rogue, "learning", {"contact": "pass"}, "m"),
        (rogue, "learning", {"payoff": {"alarms": 1.0}}, ""),
        (fdi, "paper", {}, "m/s"),
        (fdi, "paper", {"goal": "instability"}, "m"),
    ):
        assert problem.unit_of(problem.config(preset, changes)) == unit
    printed = succeeded("play", "rogue", "--preset", "paper", "--set", "duration_s=1").stdout
    assert "in m: damage + formation_charge" in " ".join(printed.split())
