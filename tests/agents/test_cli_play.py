from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_envs import find_problem
from cps_envs.core.play import play_episodes

SHORT = ("--set", "duration_s=5", "--set", "num_platoons=3")
PROBLEM = find_problem("disbanding")
CONFIG = PROBLEM.config("paper", {"duration_s": 5, "num_platoons": 3})


def play(*arguments: str) -> Any:
    result = CliRunner().invoke(app, ["play", "disbanding", *SHORT, *arguments], env={"COLUMNS": "100"})
    assert result.exit_code == 0, result.output
    return result


def test_episodes_are_those_of_the_game() -> None:
    found = json.loads(
        play("--attacker", "random", "--defender", "none", "--seed", "3", "--episodes", "4", "--json").stdout
    )
    expected = play_episodes(PROBLEM, CONFIG, {"attacker": "random", "defender": "none"}, range(3, 7))
    assert [episode["seed"] for episode in found["episodes"]] == [3, 4, 5, 6]
    for name, values in expected.items():
        assert [episode[name] for episode in found["episodes"]] == values.tolist()
        assert found["mean"][name] == pytest.approx(values.mean())
    assert found["config"]["num_platoons"] == 3


def test_the_preset_s_own_players_play_by_default() -> None:
    found = json.loads(play("--json").stdout)
    assert (found["attacker"], found["defender"]) == ("lead", "none")


def test_the_table_shows_every_metric_and_the_mean() -> None:
    printed = play("--episodes", "12").stdout
    assert "seed 11" in printed
    assert "12 episodes" in printed
    assert "velocity_error_intact" in printed
    assert "velocity_error_all + collision_penalty + end_charge" in printed


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
    result = CliRunner().invoke(app, ["play", "disbanding", *SHORT, "--render", "human"])
    assert result.exit_code == 2
    assert "--render FILE.mp4" in result.stderr
