"""A small slice of the reliability run, and its own machinery: what dies, hangs or is known already."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Barrier, Event, Thread, main_thread
from time import sleep
from typing import Any

import pytest

from cps_agents.errors import CommandError
from cps_envs.core.errors import ConfigurationError
from tests.agents.command_line import invoke, refusal, succeeded
from tests.processes import wait_until
from tests.tools.broken_parts import PART as TOYS
from tools.command import program
from tools.reliability import determinism
from tools.reliability.__main__ import reliability
from tools.reliability.child import StoppedError, run_chunk
from tools.reliability.chunk import PARTS, ROOT, Chunk, Part, Result, find_part, stamp
from tools.reliability.document import document, markdown, publish
from tools.reliability.faults.comparing import damaged, differing
from tools.reliability.faults.jobs import JOBS, warm_up
from tools.reliability.faults.part import Trials
from tools.reliability.fuzz import configurations, files
from tools.reliability.fuzz.judging import Tally, is_refusal
from tools.reliability.journal import Journal
from tools.reliability.store import Store
from tools.reliability.suite import run_parts

HANGING = """
import subprocess
from threading import Event
from time import sleep
from tools.reliability import child
from tests.tools.broken_parts import PART

usual = child._wait
def tell(process, *rest):
    print(process.pid, flush=True)
    return usual(process, *rest)

child._wait = tell
child.run_chunk(next(each for each in PART.chunks() if each.row == "hangs"), Event())
"""


def part_of(*counts: dict[str, int]) -> Part:
    def run(chunk: Chunk, journal: Journal) -> Result:
        return {"counts": counts[chunk.number], "examples": {}}

    rows = [Chunk("toy", "row", number, ("tools/reliability/chunk.py",)) for number in range(len(counts))]
    return Part("toy", "Toys", "About.", {"tried": "tried", "bad": "bad"}, frozenset({"bad"}), lambda: rows, run)


def test_edited_results_are_never_taken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(files, "CELLS", 100)
    tally = Tally(Chunk("fuzz", "slice"), Journal())
    files.cells(Chunk("fuzz", "slice"), tally)
    assert not tally.examples


@pytest.mark.parametrize("number", [1, 3])
def test_configurations_are_played_or_refused(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(configurations, "CONFIGURATIONS", 60)
    tally = Tally(Chunk("fuzz", "slice", number), Journal())
    configurations.configurations(Chunk("fuzz", "slice", number), tally)
    assert not tally.examples


def test_the_same_process_gives_the_same_hashes() -> None:
    assert determinism.hashes(3) == determinism.hashes(3)


def test_refusals_are_told_from_accidents() -> None:
    def caught(act: Any) -> BaseException:
        with pytest.raises(Exception) as found:  # noqa: PT011
            act()
        return found.value

    assert is_refusal(ConfigurationError("tau_s = -1 is outside [0, 1]"))
    assert not is_refusal(ValueError(""))
    assert not is_refusal(caught(lambda: {}["key"]))
    assert not is_refusal(caught(lambda: int("x")))
    assert is_refusal(caught(lambda: Path("/nowhere/at/all").read_text()))


@pytest.mark.parametrize(("row", "counts"), [("dies", {"inputs": 2, "crash": 1}), ("hangs", {"inputs": 0, "hang": 1})])
def test_a_process_that_dies_or_hangs_is_counted_and_the_rest_goes_on(row: str, counts: dict[str, int]) -> None:
    found = run_chunk(next(each for each in TOYS.chunks() if each.row == row), Event())
    assert found["counts"] == counts
    assert "a trial" in next(iter(found["examples"].values()))


@pytest.mark.parametrize("deadly", ["crash", "hang"])
def test_a_process_that_died_must_not_happen_in_any_part(deadly: str, tmp_path: Path) -> None:
    part = part_of({"tried": 1}, {deadly: 2})
    (found,) = run_parts([part], Store(tmp_path), 1.0, work=lambda chunk, stop: part.run(chunk, Journal()))
    assert found.violations == {deadly: 2}


def test_a_broken_machine_is_no_result() -> None:
    with pytest.raises(CommandError, match=r"(?s)could not be done.*the machine is broken"):
        run_chunk(next(each for each in TOYS.chunks() if each.row == "fails"), Event())


def test_finished_pieces_are_kept_until_their_sources_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part, done = part_of({"tried": 2}, {"tried": 3, "bad": 1}), []

    def work(chunk: Chunk, stop: Event) -> Result:
        done.append(chunk.number)
        return part.run(chunk, Journal())

    for minutes, times in ((0.0, []), (1.0, [0, 1]), (1.0, [0, 1])):
        (found,) = run_parts([part], Store(tmp_path), minutes, work=work)
        assert done == times
    assert found.totals == {"tried": 5, "bad": 1}
    assert found.violations == {"bad": 1}
    next((tmp_path / "toy").glob("*-0.json")).write_text("{", encoding="utf-8")
    monkeypatch.setattr("tools.reliability.store.stamp", lambda chunk: f"other than {stamp(chunk)}")
    run_parts([part], Store(tmp_path), 1.0, work=work)
    assert done == [0, 1, 0, 1]


def test_a_piece_that_cannot_be_done_does_not_stop_the_others(tmp_path: Path) -> None:
    part = part_of({"tried": 1}, {"tried": 2}, {"tried": 4})

    def work(chunk: Chunk, stop: Event) -> Result:
        if chunk.number == 1:
            raise CommandError("no room")
        return part.run(chunk, Journal())

    (found,) = run_parts([part], Store(tmp_path), 1.0, work=work, jobs=2)
    assert (found.totals["tried"], found.failed) == (5, ["no room"])


def test_two_pieces_run_at_once_and_an_interruption_ends_them(tmp_path: Path) -> None:
    part, together = part_of({"tried": 1}, {"tried": 1}), Barrier(3)

    def work(chunk: Chunk, stop: Event) -> Result:
        together.wait(60.0)
        assert stop.wait(60.0)
        raise StoppedError

    def interrupt() -> None:
        together.wait(60.0)
        sleep(0.2)  # until the main thread waits: a signal just before that would be heard at the end of the wait
        if hasattr(signal, "pthread_kill"):  # as Ctrl-C does, it ends what the main thread waits for
            signal.pthread_kill(main_thread().ident or 0, signal.SIGINT)
        else:
            signal.raise_signal(signal.SIGINT)

    Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        run_parts([part], Store(tmp_path), 1.0, work=work, jobs=2)
    stop = Event()
    stop.set()
    with pytest.raises(StoppedError):
        run_chunk(next(each for each in TOYS.chunks() if each.row == "hangs"), stop)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are listed by Linux")
def test_no_piece_outlives_a_command_that_is_killed() -> None:
    started = subprocess.Popen([sys.executable, "-c", HANGING], stdout=subprocess.PIPE, text=True)
    assert started.stdout is not None
    child = int(started.stdout.readline())
    started.kill()
    started.wait()
    assert wait_until(lambda: not Path(f"/proc/{child}").exists())


def test_the_page_names_what_has_to_stay_zero(tmp_path: Path) -> None:
    part = part_of({"tried": 1234, "bad": 0})
    (found,) = run_parts([part], Store(tmp_path), 1.0, work=lambda chunk, stop: part.run(chunk, Journal()))
    (tmp_path / "docs").mkdir()
    written = document([found], "abc")
    assert written["command"].startswith("python -m tools.reliability")
    assert "1,234" in markdown(written)
    assert "All of it is of commit `abc`, 20" in markdown(written)
    assert "have to stay zero: bad" in markdown(written)
    assert [path.name for path in publish(written, tmp_path)] == ["reliability.json", "reliability.md"]
    with pytest.raises(CommandError, match="folder docs"):
        publish(written, tmp_path / "nowhere")


def test_parts_take_turns(tmp_path: Path) -> None:
    one, other = (replace(part_of(*[{"tried": 1}] * 3), name=name) for name in ("one", "other"))
    rows = {part.name: [replace(chunk, part=part.name) for chunk in part.chunks()] for part in (one, other)}
    one, other = (replace(part, chunks=lambda name=part.name: rows[name]) for part in (one, other))
    done = []

    def work(chunk: Chunk, stop: Event) -> Result:
        done.append(chunk.part)
        return one.run(chunk, Journal())

    run_parts([one, other], Store(tmp_path), 1.0, work=work)
    assert done == ["one", "other"] * 3


def test_what_another_commit_has_done_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part, done = part_of({"tried": 5, "bad": 0}, {"tried": 6, "bad": 0}), []

    def work(chunk: Chunk, stop: Event) -> Result:
        done.append(chunk.number)
        return part.run(chunk, Journal())

    for commit in ("abc", "abc", "def"):
        monkeypatch.setattr("tools.reliability.store.commit", lambda commit=commit: commit)
        (found,) = run_parts([part], Store(tmp_path), 1.0, work=work)
        assert {result["commit"] for result in found.results} == {commit}
    assert done == [0, 1] * 2


def test_a_page_is_of_all_pieces_at_one_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool, idle = program(reliability), ("--minutes", "0", "--publish", "--out", str(tmp_path / "kept"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").mkdir()
    for chosen in (("fuzz",), ("--row", "league")):
        assert "leave out the parts and --row" in refusal(*chosen, *idle, program=tool)
    for commit in ("abc+", "unknown"):
        monkeypatch.setattr("tools.reliability.store.commit", lambda commit=commit: commit)
        assert "commit all changes first" in refusal(*idle, program=tool)
    monkeypatch.setattr("tools.reliability.store.commit", lambda: "abc")
    waits = invoke(*idle, program=tool)
    assert waits.exit_code == 1
    assert "pieces are left at commit abc. The same command goes on." in " ".join(waits.stderr.split())
    assert not list((tmp_path / "docs").iterdir())
    whole = part_of({"tried": 1234, "bad": 0})
    monkeypatch.setattr("tools.reliability.__main__.find_part", lambda name: replace(whole, name=name))
    work = partial(run_parts, work=lambda chunk, stop: whole.run(chunk, Journal()))
    monkeypatch.setattr("tools.reliability.__main__.run_parts", work)
    done = invoke("--minutes", "1", *idle[2:], program=tool)
    assert (done.exit_code, "Written" in done.stderr) == (0, True)
    assert "of commit `abc`" in (tmp_path / "docs" / "reliability.md").read_text(encoding="utf-8")


def test_the_page_names_commits_that_exist() -> None:
    def git(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)

    if git("rev-parse", "--is-shallow-repository").stdout.strip() != "false":
        pytest.skip("needs the history of git")
    named = set(re.findall(r"`([0-9a-f]{10})\+?`", (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")))
    assert named
    assert not [commit for commit in sorted(named) if git("cat-file", "-e", commit).returncode]


def test_the_command_refuses_unknown_parts_and_reports_without_work(tmp_path: Path) -> None:
    tool, idle = program(reliability), ("--minutes", "0", "--out", str(tmp_path))
    assert "fuzz" in refusal("fuz", program=tool)
    assert "league" in refusal("faults", "--row", "leage", program=tool)
    assert "0 of 3 pieces" in succeeded("--row", "league", *idle, program=tool).stdout
    assert json.loads(succeeded(*idle, "--json", program=tool).stdout)


def test_every_part_has_pieces_of_its_own() -> None:
    for name in PARTS:
        part = find_part(name)
        names = [chunk.name for chunk in part.chunks()]
        assert names
        assert len(set(names)) == len(names)
        assert part.forbidden <= set(part.columns) | {"crash", "hang"}


def test_damaged_and_different_files_are_found(tmp_path: Path) -> None:
    for name, text in (("one", '{"a": 1, "cpu_s": 2}'), ("two", '{"a": 1, "cpu_s": 3}'), ("three", '{"a": 2')):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.json").write_text(text, encoding="utf-8")
    assert damaged(tmp_path) == ["three/x.json"]
    assert not differing(tmp_path / "one", tmp_path / "two", names_only=False)
    for name, seconds in (("one", 1), ("two", 2)):
        (tmp_path / name / "x.csv").write_text(f"value,cpu_s\n7,{seconds}\n", encoding="utf-8")
    assert not differing(tmp_path / "one", tmp_path / "two", names_only=False)
    (tmp_path / "two" / "x.csv").write_text("value,cpu_s\n8,1\n", encoding="utf-8")
    assert differing(tmp_path / "one", tmp_path / "two", names_only=False) == ["x.csv"]
    (tmp_path / "two" / "y.txt").touch()
    (tmp_path / "two" / "meetings").mkdir()
    (tmp_path / "two" / "meetings" / "learned.json").touch()
    assert differing(tmp_path / "one", tmp_path / "two", names_only=True) == ["y.txt"]


@pytest.mark.skipif(sys.platform == "win32", reason="processes are forked and killed")
@pytest.mark.parametrize(
    "name",
    [pytest.param(job.name, marks=[] if job.name == "certify" else [pytest.mark.slow]) for job in JOBS],
)
def test_a_command_that_is_killed_or_stopped_goes_on(name: str, tmp_path: Path) -> None:
    job = next(job for job in JOBS if job.name == name)
    warm_up(job)
    trials = Trials(job, tmp_path, Journal())
    trials.kill(0, "draft")
    trials.kill(trials.writes - 1, "after")
    trials.stop(trials.writes - 1)
    assert not trials.examples
    assert {name: count for name, count in trials.counts.items() if count} == {"kills": 2, "stops": 1}


@pytest.mark.slow
def test_a_killed_league_goes_on(tmp_path: Path) -> None:
    found = run_chunk(next(chunk for chunk in find_part("faults").chunks() if chunk.row == "league"), Event())
    assert not found["examples"]
    assert found["counts"]["kills"] == 7  # of 21 in three slices: three moments of each of seven writes
