"""The report for the browser, without a browser: what is written can be read, and says what was played."""

from __future__ import annotations

import base64
import gzip
import json
import re
import threading
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from cps_agents.arena.meeting import Meeting
from cps_agents.arena.venue import Venue
from cps_agents.report import board as boards
from cps_agents.report.board import _training, telling
from cps_agents.report.reel import reel_of
from cps_agents.report.replay import MOST_FRAMES, Take, record
from cps_agents.report.report import serve, write_page
from cps_agents.zoo.references import origin_of
from cps_envs import find_problem
from cps_envs.core.picture.recording import Recorder
from tests.agents.command_line import invoke, succeeded
from tests.episodes import play

pytest.importorskip("scipy", reason="needs the extra baselines")
VENUE = ("--preset", "easy", "--set", "duration_s=9")
PLAYERS = ("--attacker", "square", "--attacker", "none", "--defender", "sliding", "--defender", "pd")
HOSTILE = (  # what is said in a script, in HTML, in a pattern, or only to a terminal
    "<!--",
    "<!-- <script>",
    "</script><script>window.ran = 1</script>",
    "<\\!-- \\u003c \\\\",
    "-->]]>&lt;'\"`${1}",
    "@content@ @title@ \\1 \\g<1>",
    "\u2028\u2029\u202e\x00\x1b[2J\ud800",
)
LARGEST_PAGE, LARGEST_EPISODE = 500_000, 2_000_000  # bytes
OUTSIDE = re.compile(r"https?://(?!www\.w3\.org/2000/svg)|(?:src|href)=[\"']//|@import|fetch\(|XMLHttpRequest")


def report(*arguments: str, code: int = 0) -> Any:
    result = invoke("report", "rogue", *VENUE, "--jobs", "1", *arguments, columns=200)
    assert result.exit_code == code, result.output
    return result


def content_of(page: Path) -> dict[str, Any]:
    found = re.search(r'id="content">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    content: dict[str, Any] = json.loads(found[1])
    return content


def episode_of(file: Path) -> dict[str, Any]:
    found = re.fullmatch(r'receiveEpisode\("([a-z0-9-]+)","([A-Za-z0-9+/=]+)"\);\n', file.read_text(encoding="utf-8"))
    assert found is not None
    assert found[1] == file.stem
    episode: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(found[2])))
    return episode


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of two attackers and two defenders."""
    here = tmp_path_factory.mktemp("report")
    report(*PLAYERS, "--episodes", "3", "--replays", "2", "--out", str(here / "out"), "--meetings", str(here / "kept"))
    return here / "out"


def test_the_page_is_whole_small_and_loads_nothing_from_elsewhere(folder: Path) -> None:
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert len(text) < LARGEST_PAGE
    assert OUTSIDE.search(text) is None
    assert "@content@" not in text
    open_tags: list[str] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            if tag not in ("meta", "link"):
                open_tags.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert open_tags.pop() == tag

    Reader().feed(text)
    assert open_tags == []


def test_the_matrix_holds_the_meetings(folder: Path) -> None:
    (board,) = content_of(folder / "index.html")["boards"]
    assert [each["name"] for each in board["attackers"]] == ["square", "none"]
    assert [each["name"] for each in board["defenders"]] == ["sliding", "pd"]
    assert board["missing"] == 0
    expected = play(find_problem("rogue"), "square", "pd", range(3), "easy", duration_s=9.0)
    cell = board["cells"][0][1]
    for name, values in expected.items():
        assert cell["metrics"][name]["values"] == pytest.approx(values.tolist(), rel=1e-5)
    assert len(cell["takes"]) == 2


def test_trained_policies_tell_how_they_came_about() -> None:
    def told(reference: str) -> str:
        return _training(origin_of("rogue", reference))

    assert told("zoo:hvac-attack") == "Trained by shared-ppo against `largest`, from preset `learning`."
    assert told("zoo:rogue-attack-self-play-1").startswith("Trained by shared-ppo against `a strategy of self-play`")
    assert "against a mixture of opponents" in told("zoo:rogue-attack")
    assert told("square") == ""


def test_an_episode_is_the_one_that_was_played(folder: Path) -> None:
    (board,) = content_of(folder / "index.html")["boards"]
    for row in board["cells"]:
        for cell in row:
            for take in cell["takes"]:
                file = folder / "episodes" / f"{take['key']}.js"
                assert file.stat().st_size < LARGEST_EPISODE
                episode = episode_of(file)
                assert episode["return"] == pytest.approx(cell["metrics"]["return"]["values"][take["seed"]], rel=1e-5)
                frames = len(episode["times"])
                assert 2 < frames <= MOST_FRAMES
                assert len(episode["reel"]["frames"]) == frames
                for tracks in episode["tracks"].values():
                    rows = [row for group in tracks.values() for track in group for row in track["rows"]]
                    assert {len(row) for row in rows} == {frames}


def test_a_track_stands_for_physical_values(folder: Path) -> None:
    episode = episode_of(next((folder / "episodes").glob("*.js")))
    (action,) = episode["tracks"]["attacker"]["actions"]
    assert -1 <= action["low"] <= action["high"] <= 1
    for group in episode["tracks"].values():
        for track in group["observations"]:
            assert all(0 <= level <= track["steps"] for row in track["rows"] for level in row)


def test_finished_meetings_are_shown_without_playing(folder: Path, tmp_path: Path) -> None:
    kept = folder.parent / "kept"
    again = report(*PLAYERS, "--attacker", "random", "--episodes", "3", "--replays", "0", "--kept", "--out",
                   str(tmp_path / "a"), "--meetings", str(kept))  # fmt: skip
    assert "not been played" not in again.stderr  # nobody of the attacker `random` has played: it is left out
    (next(kept.glob("rogue-square-pd-*.json"))).unlink()
    again = report(*PLAYERS, "--episodes", "3", "--replays", "0", "--kept", "--out", str(tmp_path / "b"), "--meetings",
                   str(kept))  # fmt: skip
    assert "1 pairs have not been played" in again.stderr
    (board,) = content_of(tmp_path / "b" / "index.html")["boards"]
    assert (board["missing"], board["value"], board["cells"][0][1]) == (1, None, "not played")


def test_pairs_that_cannot_play_do_not_stop_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(item: Any) -> tuple[Any, str]:
        return (None, "their forms clash") if "pd" in item[1].defender else play_one(item)

    play_one = boards._try
    monkeypatch.setattr(boards, "_try", broken)
    report(*PLAYERS, "--episodes", "1", "--replays", "0", "--out", str(tmp_path / "out"))
    (board,) = content_of(tmp_path / "out" / "index.html")["boards"]
    assert [row[1] for row in board["cells"]] == ["their forms clash"] * 2
    assert (board["missing"], board["value"]) == (0, None)
    assert all("return" in row[0]["metrics"] for row in board["cells"])


def test_a_league_and_a_chapter_write_the_same_page(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra baselines")
    pair = ("--attacker", "square", "--defender", "pd", "--episodes", "2", "--jobs", "1")
    places = ("--out", str(tmp_path / "league"), "--meetings", str(tmp_path / "kept"), "--html", str(tmp_path / "page"))
    succeeded("league", "rogue", *VENUE, *pair, *places)
    (board,) = content_of(tmp_path / "page" / "index.html")["boards"]
    (take,) = board["cells"][0][0]["takes"]
    assert (tmp_path / "page" / "episodes" / f"{take['key']}.js").is_file()
    assert board["value"] is None
    assert "20 episodes" in board["few"]  # two are too few for the value of a game, and for intervals
    assert {each["low"] for each in board["cells"][0][0]["metrics"].values()} == {None}
    succeeded("league", "rogue", *VENUE, *pair[:4], "--episodes", "20", "--jobs", "1", *places, "--fresh")
    (board,) = content_of(tmp_path / "page" / "index.html")["boards"]
    assert board["value"]["low"] < board["value"]["mean"] < board["value"]["high"]
    assert not board["few"]
    succeeded("reproduce", "testbed", "--quick", "--jobs", "1", "--html", str(tmp_path / "ch"))
    sheets = content_of(tmp_path / "ch" / "index.html")["sheets"]
    assert all(len(row) == len(sheet["headings"]) for sheet in sheets for row in sheet["rows"])


def test_what_cannot_be_shown_is_told_in_a_sentence(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    (tmp_path / "runs" / "seed-0").mkdir(parents=True)
    run = tmp_path / "runs" / "seed-0" / "evaluations.jsonl"
    run.write_text('{"steps": 0}\n')
    (tmp_path / "empty").mkdir()
    quick = ("--quick", "--replays", "0", "--out", str(tmp_path / "out"))
    for arguments, said in (
        (("--runs", str(tmp_path / "empty")), "there is no evaluations.jsonl in it"),
        (("--runs", str(tmp_path / "runs")), "Remove the run, or train it again"),
        (("--paper", str(tmp_path / "empty")), "cps-envs reproduce ch5 --csv"),
        (("--kept",), "no finished meetings of rogue"),
    ):
        assert said in report(*quick, *arguments, code=2).stderr
    assert str(blocked) in report("--quick", "--replays", "0", "--out", str(blocked / "deeper"), code=2).stderr


def test_learning_curves_and_the_paper_stand_beside_the_matrix(tmp_path: Path) -> None:
    run = tmp_path / "runs" / "rogue-attack" / "seed-0"
    run.mkdir(parents=True)
    (run / "run.json").write_text(
        json.dumps({"recipe": {"problem": "rogue", "role": "attacker", "algorithm": "shared-ppo"}})
    )
    rows = [{"steps": 512 * k, "validation": 3.0 + k, "return": 0.0} for k in range(500)]
    (run / "evaluations.jsonl").write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "table_5_1.csv").write_text("case,paper,ours\nA </script>,1.0,1.1\n")
    report("--quick", "--replays", "0", "--runs", str(tmp_path / "runs"), "--paper", str(tmp_path / "paper"), "--out",
           str(tmp_path / "out"))  # fmt: skip
    content = content_of(tmp_path / "out" / "index.html")
    (curve,), (sheet,) = content["curves"], content["sheets"]
    assert (curve["run"], curve["role"], curve["best"]) == ("rogue-attack", "attacker", 502.0)
    assert (curve["steps"][0], curve["steps"][-1]) == (0.0, 512.0 * 499)
    assert len(curve["steps"]) <= 202
    assert sheet["rows"] == [["A </script>", "1.0", "1.1"]]


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_ends_the_content_of_a_page(text: str, tmp_path: Path) -> None:
    content = {"title": text, "sheets": [{text: [text, 1.5, None]}]}
    page = write_page(tmp_path, content)
    assert content_of(page) == content
    inside = page.read_text(encoding="utf-8").partition('id="content">')[2].partition("</script>")[0]
    assert "<" not in inside
    assert page.read_text(encoding="utf-8").count("</script>") == 2  # its own


def test_serving_tells_the_address_even_without_a_browser(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found, readers = [], []

    def look(address: str) -> bool:
        readers.append(threading.Thread(target=lambda: found.append(urlopen(f"{address}index.html").read())))
        readers[0].start()
        return False

    def answer_one(server: Any) -> None:
        server.handle_request()
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", look)
    monkeypatch.setattr("cps_agents.report.report.ThreadingHTTPServer.serve_forever", answer_one)
    serve(folder)
    readers[0].join(10.0)
    said = capsys.readouterr().err
    assert found == [(folder / "index.html").read_bytes()]
    assert "No browser was found" in said
    assert "http://127.0.0.1:" in said


def test_the_telling_episodes_are_the_median_and_the_extremes() -> None:
    assert telling([3.0, 1.0, 2.0, 5.0, 4.0], 3) == [0, 3, 1]
    assert telling([3.0, 1.0], 5) == [0, 1]
    assert telling([3.0], 0) == []


def test_moments_are_left_out_until_an_episode_fits() -> None:
    meeting = Meeting(Venue("rogue", "easy", {"duration_s": 20.0}), "square", "pd", 1)
    whole, small = (record(Take(meeting, 0, "key", most_bytes=most)) for most in (1_000_000, 20_000))
    assert len(small) < len(whole)
    frames = [len(json.loads(gzip.decompress(base64.b64decode(each)))["times"]) for each in (whole, small)]
    assert MOST_FRAMES == frames[0] > frames[1] > 10


def pictures(document: dict[str, Any]) -> list[list[list[Any]]]:
    """What the page makes of a reel: the shapes of each picture, with colours by name."""
    shapes: list[list[Any]] = []
    for kind, *rest in document["shapes"]:
        if kind.endswith("+"):
            color, base, kept, *steps = rest
            points = shapes[base][2 : 2 + kept]
            for step in steps:
                points.append(round((points[-2] if len(points) > 1 else 0.0) + step / 10, 1))
            rest = [color, *points]
        named = [document["colors"][rest[0]], *rest[1:]] if kind not in ("clip", "sprite") else rest
        shapes.append([kind.rstrip("+"), *named])
    found, before, taken = [], [], 0  # type: ignore[var-annotated]
    for numbers in document["frames"]:
        now, end = [], 0
        for skipped, count in zip(numbers[::2], numbers[1::2], strict=True):
            if count:
                now += before[end + skipped : end + skipped + count]
                end += skipped + count
            else:
                taken += skipped
                now.append(taken)
        found.append([shapes[place] for place in now])
        before = now
    return found


def test_a_reel_gives_back_every_picture() -> None:
    recorder = Recorder(80, 60)
    drawn, expected = [], []
    for moment in range(12):
        recorder.fill((255, 255, 255))
        recorder.box((0, 0, 10, 10), (1, 2, 3))
        curve = [(4.0 * k, 30.0 + 7.3 * ((k * k) % 5)) for k in range(moment + 2)]
        recorder.path(curve, (9, 9, 9))
        recorder.path([(x, y + 1) for x, y in curve], (9, 9, 9))
        for k in range(moment):
            recorder.box((k, 2 * k, 2, 2), (5, 5, 5))
        with recorder.within((0, 0, moment + 1, 5)):
            recorder.circle((moment, 4), 3, (7, 7, 7))
        recorder.box((0, 0, 10, 10), (1, 2, 3))
        drawn.append(recorder.shapes)
        expected.append([list(shape) for shape in recorder.shapes])
    assert pictures(json.loads(json.dumps(reel_of(recorder, drawn)))) == expected


def test_a_choice_that_lasts_shorter_than_a_moment_is_seen() -> None:
    packed = record(Take(Meeting(Venue("disbanding"), "adaptive", "copy", 1), 11, "key"))
    (track,) = json.loads(gzip.decompress(base64.b64decode(packed)))["tracks"]["attacker"]["actions"]
    assert sum(level > 0 for level in track["rows"][0]) == 2
