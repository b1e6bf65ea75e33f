"""Work on a cluster, without Ray: a stand-in hands pieces over as Ray does, as bytes."""

from __future__ import annotations

import json
import math
import os
import pickle
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

pytest.importorskip("scipy", reason="needs the baselines")
pytest.importorskip("typer", reason="needs the command line")

from cps_agents import cluster
from cps_agents.cli import whole
from cps_agents.cluster import Asked, check_seen, do, marked
from cps_agents.errors import CommandError
from cps_agents.learning.learner import train_all
from cps_agents.learning.recipe import Recipe, changed
from cps_agents.learning.run import TrainingJob
from cps_agents.scoring.playing import pays
from cps_agents.scoring.tracks import Track
from cps_agents.workers import Workers
from cps_envs.core.declare.panel import Contestant
from tests.agents.command_line import refusal, succeeded

MEET = ("evaluate", "rogue", "attacker", "--attacker", "none", "--attacker", "square", "--defender", "pd")
SHORT = ("--set", "duration_s=3", "--set", "onset_s=0", "--episodes", "2")


class StandIn(Executor):
    """Does each piece in this process, from bytes to bytes."""

    def __init__(self) -> None:
        self.asked, self.done = Asked.here(), 0

    def executor(self) -> StandIn:
        """Itself: a cluster and its executor."""
        return self

    def __str__(self) -> str:
        return "Cluster of the test."

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        found: Future[Any] = Future()
        self.done += 1
        try:
            asked, function, args = pickle.loads(pickle.dumps((self.asked, function, args)))
            found.set_result(pickle.loads(pickle.dumps(do(asked, function, *args, **kwargs))))
        except Exception as error:
            found.set_exception(error)
        return found


@pytest.fixture
def machines(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> StandIn:
    """A stand-in that every --cluster joins, in a folder of its own."""
    found = StandIn()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "join", lambda address: found)
    return found


def test_a_cluster_does_what_processes_do() -> None:
    with Workers(StandIn()) as workers:
        assert dict(workers.run(math.sqrt, [16.0, 4.0])) == {16.0: 4.0, 4.0: 2.0}
        with pytest.raises(ValueError, match="math domain error"):
            list(workers.run(math.sqrt, [-1.0]))


def test_the_same_numbers_come_back(machines: StandIn) -> None:
    elsewhere, here = (
        json.loads(succeeded(*MEET, *SHORT, *where, "--json").stdout)["standings"]
        for where in (("--cluster", "auto", "--meetings", "elsewhere"), ("--jobs", "1", "--meetings", "here"))
    )
    assert elsewhere == here
    assert machines.done == 2
    assert len(list(Path("elsewhere").glob("*.json"))) == 2


def test_a_score_is_the_same(machines: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cps_agents.scoring.playing.BATCH", 2)
    track = Track("rogue", "attacker", 3, (Contestant("pd"), Contestant("none")))
    seeds = [range(3), range(1)]  # more than a batch, and less
    told: list[int] = []
    with Workers(machines) as pool:
        elsewhere = pays(track, "none", seeds, lambda done, cpu_s: told.append(done), pool)
    for paid, again in zip(elsewhere, pays(track, "none", seeds), strict=True):
        assert paid.tolist() == again.tolist()
    assert max(told) == told[-1] == 4
    assert machines.done == 3


def test_runs_are_trained_in_a_folder_that_all_see(machines: StandIn) -> None:
    pytest.importorskip("cma", reason="needs the baselines")
    knobs: dict[str, Any] = {
        **{"name": "tiny", "problem": "rogue", "preset": "easy", "overrides": {"duration_s": 3.0}},
        **{"algorithm": "cma-es", "family": "rogue-switching", "population": 4, "scenes": [{"episodes": 2}]},
        **{"total_timesteps": 8, "evaluation_episodes": 2},
    }
    recipe = changed(Recipe(), knobs)
    jobs, alone = ([TrainingJob(recipe, seed, Path(name) / str(seed), "test") for seed in (0, 1)] for name in "ab")
    found = train_all(jobs, machines, "tiny")
    assert [each["policy"] for each in found] == [each["policy"] for each in train_all(alone, 1, "tiny")]
    assert machines.done == 2
    assert sorted(path.name for path in Path("a").iterdir()) == ["0", "1"]
    assert train_all(jobs, machines, "tiny") == found


def test_a_machine_that_sees_another_folder_is_told(tmp_path: Path) -> None:
    with marked(tmp_path / "runs") as mark:
        check_seen(mark)
    assert not list((tmp_path / "runs").iterdir())
    with pytest.raises(CommandError, match=r"does not see .*runs: with --out, name a folder that all machines share"):
        check_seen(mark)


def test_a_machine_with_another_installation_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    here = Asked.here()
    with pytest.raises(CommandError, match=r"has numpy .* instead of 0\.1: install the same versions everywhere"):
        do(replace(here, versions={**here.versions, "numpy": "0.1"}), math.sqrt, 4.0)
    with pytest.raises(CommandError, match="has other code of cps-envs"):
        do(replace(here, sources="other"), math.sqrt, 4.0)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CPS_ENVS_TRUST", "")
    assert do(replace(here, folder=str(tmp_path.parent), trusted="1"), os.getcwd) == str(tmp_path.parent)
    assert os.environ["CPS_ENVS_TRUST"] == "1"
    assert do(replace(here, folder="/nowhere"), os.getcwd) == str(tmp_path.parent)


def test_an_error_of_the_work_comes_without_the_wrapping() -> None:
    wrapped = RuntimeError("remote traceback")
    wrapped.cause = CommandError("no such policy")  # type: ignore[attr-defined]
    assert str(cluster._own(wrapped)) == "no such policy"
    wrapped.cause = ModuleNotFoundError("No module named 'mine'")  # type: ignore[attr-defined]
    assert "install there what is installed here" in str(cluster._own(wrapped))
    assert isinstance(cluster._own(RuntimeError("Worker died.\nLong story")), CommandError)


def test_only_results_are_printed_to_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    stream: Any = cluster.Results(sys.stdout)
    print("[1]", file=stream, flush=True)
    thread = Thread(target=print, args=("a worker died",), kwargs={"file": stream})
    thread.start()
    thread.join()
    assert capsys.readouterr() == ("[1]\n", "a worker died\n")
    assert stream.encoding == sys.stdout.encoding


def test_without_ray_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "ray", None)
    said = refusal(*MEET, "--cluster", "auto")
    assert said == "Error: --cluster needs the package 'ray'. Install it with: pip install \"cps-envs[ray]\""


def test_what_cannot_be_obeyed_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert "'somewhere' is no address" in refusal(*MEET, "--cluster", "somewhere")
    assert "leave one out" in refusal(*MEET, "--cluster", "auto", "--jobs", "2")
    assert "a list is no work to divide" in refusal("train", "--list", "--cluster", "auto")
    assert "a list is no work to divide" in refusal("reproduce", "benchmark", "--list", "--cluster", "auto")
    assert "plays nothing" in refusal("report", "rogue", "--kept", "--replays", "0", "--cluster", "auto")
    assert "No such option: --cluster" in refusal("list", "--cluster", "auto")


def test_every_command_with_processes_takes_a_cluster() -> None:
    def options(name: str, command: Any) -> dict[str, set[str]]:
        inside = getattr(command, "commands", None)
        if inside is None:
            return {name: {option for each in command.params for option in each.opts}}
        return {word: found for each, part in inside.items() for word, found in options(f"{name} {each}", part).items()}

    found = options("", whole())
    parallel = {name for name, each in found.items() if "--jobs" in each}
    assert parallel - {name for name, each in found.items() if "--cluster" in each} == {" warm"}
    assert {name for name, each in found.items() if "--cluster" in each} <= parallel
    assert {" train", " evaluate", " score policy", " league", " best-response", " self-play", " report"} <= parallel
    assert {" certify", " reproduce ch5", " reproduce all", " reproduce benchmark"} <= parallel
    parted = {name for name, each in found.items() if "--part" in each}
    assert parted - {" reproduce ch5"} == {" train", " evaluate", " league", " reproduce benchmark"}  # ch5: its parts
