"""Datasets in Minari's format."""

from __future__ import annotations

import errno
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.datasets import dataset_name, write_dataset
from cps_agents.errors import CommandError
from cps_envs.core.game.play import play_episodes
from cps_envs.registration import find_problem
from tests.agents.command_line import refusal, succeeded

minari = pytest.importorskip("minari")
pytest.importorskip("h5py")

CASES: dict[str, Any] = {
    "fdi": ("attacker", {"attacker": "random", "defender": "none"}, "easy", {}),
    "hvac": ("defender", {"attacker": "constant", "defender": "mtd2"}, "paper",
             {"num_steps": 130, "window_steps": 100, "onset_step": 90}),
    "rogue": ("defender", {"attacker": "square", "defender": "sliding"}, "easy", {"duration_s": 3.0}),
    "disbanding": ("attacker", {"attacker": "random", "defender": "heuristic"}, "easy", {"duration_s": 8.0}),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


@pytest.mark.parametrize("name", CASES)
def test_recovered_environment_repeats_the_episodes(name: str) -> None:
    role, players, preset, overrides = CASES[name]
    problem = find_problem(name)
    seeds = range(50, 53)
    dataset_id = f"cps_envs/{name}/test-v0"
    write_dataset(problem, role, players, preset, overrides, seeds, dataset_id)
    read = minari.load_dataset(dataset_id)
    sign = 1 if role == "attacker" else -1
    played = play_episodes(problem, problem.config(preset, overrides), players, seeds)
    env = read.recover_environment()
    for number, episode in enumerate(read.iterate_episodes()):
        assert sign * episode.rewards.sum() == pytest.approx(played["return"][number], abs=1e-9)
        observation, _ = env.reset(seed=seeds[number])
        np.testing.assert_array_equal(observation, episode.observations[0])
        for step, action in enumerate(episode.actions):
            observation, reward, terminated, truncated, info = env.step(action)
            np.testing.assert_array_equal(observation, episode.observations[step + 1])
            assert (reward, terminated, truncated) == (
                episode.rewards[step],
                episode.terminations[step],
                episode.truncations[step],
            )
        for key in played:
            if key != "return":
                assert info[key] == episode.infos[key][-1]
        assert terminated or truncated


def test_a_dataset_is_whole_or_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    role, players, preset, overrides = CASES["fdi"]
    usual = (find_problem("fdi"), role, players, preset, overrides, range(2), "cps_envs/fdi/mine-v0")

    def interrupted(**given: Any) -> None:
        create(**given)
        raise KeyboardInterrupt

    create = minari.create_dataset_from_buffers
    monkeypatch.setattr(minari, "create_dataset_from_buffers", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_dataset(*usual)
    assert list(tmp_path.iterdir()) == []

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("cps_agents.datasets._have_room", full)
    with pytest.raises(OSError, match="No space left"):
        write_dataset(*usual)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    write_dataset(*usual)
    assert set(minari.list_local_datasets()) == {"cps_envs/fdi/mine-v0"}
    assert not (tmp_path / ".drafts").exists()


def test_room_is_made_for_all_of_a_dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rooms: list[int] = []
    monkeypatch.setattr("cps_agents.datasets._have_room", lambda folder, size: rooms.append(size))
    for name, (role, players, preset, overrides) in CASES.items():
        write_dataset(find_problem(name), role, players, preset, overrides, range(2), f"{name}-v0")
        taken = sum(path.stat().st_size for path in (tmp_path / f"{name}-v0").rglob("*") if path.is_file())
        assert taken < rooms[-1]


def test_names_are_checked(tmp_path: Path) -> None:
    role, players, preset, overrides = CASES["fdi"]
    write_dataset(find_problem("fdi"), role, players, preset, overrides, range(1), "mine-v0")
    with pytest.raises(CommandError, match="there is a dataset mine-v0 already"):
        write_dataset(find_problem("fdi"), role, players, preset, overrides, range(1), "mine-v0")
    (tmp_path / "half-v0" / "data").mkdir(parents=True)  # Minari does not list it
    with pytest.raises(CommandError, match=r"there is a dataset half-v0 already: .*or delete .*half-v0"):
        write_dataset(find_problem("fdi"), role, players, preset, overrides, range(1), "half-v0")
    with pytest.raises(CommandError, match="not the name of a dataset"):
        write_dataset(find_problem("fdi"), role, players, preset, overrides, range(1), "mine")


def test_names_tell_settings_apart() -> None:
    fdi, players = find_problem("fdi"), {"attacker": 'tracker?rest_of_it=["a"]', "defender": "cusum"}
    usual: Any = (fdi, "learning", {}, "attacker", players, range(5, 8))
    others: list[Any] = [
        (fdi, "paper", {}, "attacker", players, range(5, 8)),
        (fdi, "learning", {"gain_spread": 0.0}, "attacker", players, range(5, 8)),
        (fdi, "learning", {"gain_spread": 0.1}, "attacker", players, range(5, 8)),
        (fdi, "learning", {}, "defender", players, range(5, 8)),
        (fdi, "learning", {}, "attacker", {**players, "attacker": "tracker"}, range(5, 8)),
        (fdi, "learning", {}, "attacker", players, range(6, 9)),
        (fdi, "learning", {}, "attacker", players, range(5, 9)),
    ]
    names = {dataset_name(*each) for each in (usual, *others)}
    assert len(names) == 1 + len(others)
    assert dataset_name(*usual) == dataset_name(*usual)
    assert re.fullmatch(r"cps_envs/fdi/learning/attacker-tracker-cusum-[0-9a-f]{8}-v0", dataset_name(*usual))


def test_command() -> None:
    """`cps-envs dataset`, then `minari.load_dataset`"""
    words = ["dataset", "fdi", "--role", "attacker", "--attacker", "oracle", "--preset", "paper", "--episodes", "2"]
    result = succeeded(*words, "--json")
    document = json.loads(result.stdout)
    assert document["steps"] == minari.load_dataset(document["id"]).total_steps == 40
    assert "/paper/attacker-oracle-" in document["id"]


def test_the_default_is_preset_learning() -> None:
    result = succeeded("dataset", "rogue", "--role", "defender", "--set", "duration_s=3", "--episodes", "2", "--json")
    document = json.loads(result.stdout)
    assert document["preset"] == "learning"
    assert document["id"].startswith("cps_envs/rogue/learning/defender-mixture-monitor-")
    env: Any = minari.load_dataset(document["id"]).recover_environment().unwrapped
    assert env.config == find_problem("rogue").config("learning", {"duration_s": 3.0})


def test_a_problem_without_ids_makes_no_dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    said = refusal("--trust", "dataset", "cps_paper.testbed.robots.problem:TESTBED", "--role", "attacker")
    assert "a dataset names its environment by Gymnasium's id, and there is no cps_envs/" in said
    assert "cps_envs.register(...)" in said
    assert list(tmp_path.iterdir()) == []
