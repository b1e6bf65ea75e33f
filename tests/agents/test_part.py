"""The parts of a command that share a folder: each does its own, and whichever ends last joins them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Barrier
from typing import Any, ClassVar

import pytest

pytest.importorskip("scipy", reason="needs the baselines")
pytest.importorskip("typer", reason="needs the command line")

from cps_agents.arena.play import finish_all
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.part import WHOLE, Part, Unfinished, parse_part
from cps_agents.workers import Workers
from cps_envs.core.documents import Entry
from tests.agents.command_line import invoke, refusal, succeeded

MEET = ("evaluate", "rogue", "attacker", "--attacker", "none", "--attacker", "square", "--defender", "pd")
SHORT = ("--set", "duration_s=3", "--set", "onset_s=0", "--episodes", "2", "--jobs", "1")
ran: list[str] = []


@dataclass(frozen=True)
class Piece:
    """A piece of work that counts how often it is done."""

    kind: ClassVar[str] = "piece"
    name: str
    problem: str = "rogue"
    label: str = ""

    def run(self) -> dict[str, Any]:
        ran.append(self.name)
        return {"name": self.name}

    def check(self, result: Entry) -> None:
        result["name"].text()


def joined(jobs: list[Piece], store: Store) -> list[str] | int:
    """What a part has in the end: all results, or how many are missing."""
    try:
        with Workers(1) as pool:
            return sorted(result["name"] for _, result in finish_all(jobs, store, pool))
    except Unfinished as others:
        return others.missing


@pytest.mark.parametrize("of", [1, 2, 3, 7])
def test_parts_have_every_piece_once(of: int) -> None:
    shares = [Part(number, of).share(range(5)) for number in range(1, of + 1)]
    assert sorted(place for share in shares for place in share) == list(range(5))


def test_a_part_is_written_as_number_and_count() -> None:
    assert parse_part("2/16") == Part(2, 16)
    assert str(Part(2, 16)) == "2/16"
    assert parse_part("1/1") == WHOLE
    for wrong in ("0/2", "3/2", "2", "/", "a/b", "1/2/3", "-1/2", " 1/2", "1/0", "²/3"):
        with pytest.raises(CommandError, match="such as 2/16"):
            parse_part(wrong)


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 1, 2)])
def test_each_part_does_its_own_and_the_last_joins(order: tuple[int, ...], tmp_path: Path) -> None:
    ran.clear()
    jobs = [Piece(f"piece {place}") for place in range(7)]
    found = [joined(jobs, Store(tmp_path, part=Part(number, 3))) for number in order]
    names = [job.name for job in jobs]
    assert found[1:] == [len(Part(order[2], 3).share(jobs)), names]
    assert sorted(ran) == names
    assert joined(jobs, Store(tmp_path, part=Part(1, 3))) == joined(jobs, Store(tmp_path)) == names
    assert sorted(ran) == names


def test_of_parts_that_end_at_once_one_at_least_joins(tmp_path: Path) -> None:
    for attempt in range(10):
        ran.clear()
        together, jobs = Barrier(4), [Piece(f"piece {place}") for place in range(8)]

        def part(number: int, attempt: int = attempt, together: Barrier = together, jobs: Any = jobs) -> Any:
            store = Store(tmp_path / str(attempt), part=Part(number, 4))
            together.wait()
            return joined(jobs, store)

        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(part, range(1, 5)))
        assert [job.name for job in jobs] in found
        assert len(ran) == 8


def test_a_command_is_done_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = invoke(*MEET, *SHORT, "--part", "1/2", "--json")
    assert (first.exit_code, first.stdout) == (0, "")
    said = " ".join(first.stderr.split())
    assert (
        "Part 1/2 is done. The other parts have 1 of the meetings left: whichever ends last gives the results" in said
    )
    last = json.loads(succeeded(*MEET, *SHORT, "--part", "2/2", "--json").stdout)
    whole = json.loads(succeeded(*MEET, *SHORT, "--meetings", "again", "--json").stdout)
    assert last["standings"] == whole["standings"]


def test_a_league_is_written_by_the_last_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("league", "rogue", "--attacker", "none", "--attacker", "square", "--defender", "pd", *SHORT)
    succeeded(*words, "--part", "2/2")
    assert not Path("league").exists()
    succeeded(*words, "--part", "1/2")
    assert {path.name for path in Path("league").glob("rogue.*")} == {"rogue.json", "rogue.csv", "rogue.png"}


def test_runs_are_trained_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cma", reason="needs the baselines")
    monkeypatch.chdir(tmp_path)
    short = ("--preset", "easy", "--set", "duration_s=3", "--set", "onset_s=0", "--knob", "evaluation_episodes=2")
    search = ("--algo", "cma-es", "--knob", "family=rogue-switching", "--knob", "population=4", "--steps", "8")
    words = ("train", "RogueAttack-v0", *search, *short)
    first = succeeded(*words, "--seeds", "2", "--part", "1/2", "--jobs", "1")
    assert first.stdout == ""
    assert "The other parts have 1 of the runs left" in " ".join(first.stderr.split())
    assert len(list(Path("runs").rglob("run.json"))) == 1
    assert "seed-1" in succeeded(*words, "--seeds", "2", "--part", "2/2", "--jobs", "1").stdout


def test_what_no_part_can_do_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "--part '3/2'" in refusal(*MEET, "--part", "3/2")
    assert "leave one out" in refusal(*MEET, "--part", "1/2", "--fresh")
    assert "a list is no work to divide" in refusal("train", "--list", "--part", "1/2")
    assert "No such option: --part" in refusal("self-play", "rogue", "--part", "1/2")


@pytest.mark.slow  # a fresh process for each task
def test_the_array_job_of_the_page_gives_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page's file as Slurm runs it: once for each number, with the words behind its name."""
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```bash\n(.*?)```", page, re.DOTALL)
    (tasks,) = re.findall(r"^#SBATCH --array=1-(\d+)$", script, re.MULTILINE)
    assert f"PARTS={tasks} " in script
    program = Path(sys.executable).parent / "cps-envs"
    here = script.replace("/shared/project", str(tmp_path)).replace(".venv/bin/cps-envs", str(program))
    Path("parts.sbatch").write_text(here.replace(f"PARTS={tasks}", "PARTS=2"), encoding="utf-8")
    printed = [
        subprocess.run(
            ["bash", "parts.sbatch", *MEET, *SHORT],
            env={**os.environ, "SLURM_ARRAY_TASK_ID": number, "CPS_ENVS_MEETINGS": str(tmp_path / "meetings")},
            check=True,
            capture_output=True,
            text=True,
        )
        for number in ("1", "2")
    ]
    assert printed[0].stdout == ""
    assert "The other parts have 1 of the meetings left" in " ".join(printed[0].stderr.split())
    assert printed[1].stdout == succeeded(*MEET, *SHORT, "--meetings", "meetings").stdout
