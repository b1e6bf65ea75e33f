"""What the dissertation has is found, or said to be missing; the generated pages of the site are current."""

from __future__ import annotations

import dataclasses
import functools
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import gymnasium
import pytest

from cps_agents.cli import whole
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.policies.lookup import policy_names
from cps_paper.commands.chapters import COMMANDS, Command
from cps_paper.printed.items import Item, Place, items
from cps_paper.testbed.robots.problem import TESTBED
from tools.pages import __main__ as docs

ROOT = Path(__file__).parents[2]
NUMBERED = {  # what the dissertation numbers in chapters 2 to 5, counted in its text
    "Figure": [
        *(f"2.{n}" for n in range(1, 6)),
        "3.1",
        "3.2",
        *(f"4.{n}" for n in range(1, 9)),
        *(f"5.{n}" for n in range(1, 12)),
    ],
    "Table": ["2.1", "2.2", "2.3", *(f"3.{n}" for n in range(1, 8)), "4.1", "4.2", "5.1"],
    "Algorithm": ["1", "2", "3", "4"],
}


@pytest.fixture(scope="module")
def pages() -> Iterator[dict[str, str]]:
    """The pages, computed once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(docs, "boards", functools.cache(docs.boards))
        texts = docs.pages(docs.boards())
        patch.setattr(docs, "pages", lambda _: texts)
        yield texts


def problem_of(name: str) -> object:
    return TESTBED if name == "testbed" else find_problem(name)


def exists(place: Place) -> bool:
    first, _, rest = place.name.partition(".")
    if place.kind == "missing":
        return len(place.name) > 10  # a reason
    if place.kind == "file":
        return (ROOT / place.name).is_file()
    if place.kind == "command":
        command = whole()
        for word in place.name.split():
            command = getattr(command, "commands", {}).get(word)
        return command is not None
    if place.kind == "env":
        return f"cps_envs/{place.name}" in gymnasium.registry
    if place.kind == "policy":
        role, _, name = rest.partition(".")
        return name in policy_names(first, role)  # type: ignore[arg-type]
    if place.kind == "preset":
        return rest in problem_of(first).presets  # type: ignore[attr-defined]
    if place.kind == "option":
        config = problem_of(first).presets["paper"]  # type: ignore[attr-defined]
        return rest in {field.name for field in dataclasses.fields(config)}
    chapter, _, part = place.name.partition(" ")
    (command,) = (each for each in COMMANDS if each.name == chapter)
    return part in command.load().parts if command.parts else not part


def numbers(item: Item) -> Iterator[tuple[str, str]]:
    """The numbered things that an item stands for."""
    kind = item.name.split()[0].removesuffix("s")
    ends = re.findall(r"\d+(?:\.\d+)?", item.name)
    known = NUMBERED.get(kind, [])
    if known:
        first, last = known.index(ends[0]), known.index(ends[-1])
        yield from ((kind, number) for number in known[first : last + 1])


@pytest.mark.parametrize("command", [each for each in COMMANDS if each.parts], ids=lambda each: each.name)
def test_a_command_names_the_parts_of_its_chapter(command: Command) -> None:
    known, text = list(command.load().parts), command.parts.removeprefix("Only this part: ").partition(";")[0]
    named = []
    for each in re.split(", | or ", text):
        first, _, last = each.partition(" to ")
        named += known[known.index(first) : known.index(last or first) + 1]
    assert sorted(named) == sorted(known)


LEFT_OUT_BY_QUICK = {
    "ch2": {"tried", "platoons", "text"},
    "ch3": {"3.3", "3.4", "3.6", "3.7", "horizons"},
    "ch4": {"4.2", "4.8fig", "deviation", "early"},
    "ch5": {"seats", "together", "fit", "headroom"},
    "testbed": set(),
}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.name)
def test_quick_leaves_out_the_long_parts_unless_they_are_named(command: Command) -> None:
    chapter = command.load()
    assert chapter.chosen() == tuple(chapter.parts)
    assert set(chapter.chosen()) - set(chapter.chosen(quick=True)) == LEFT_OUT_BY_QUICK[command.name]
    assert chapter.chosen(reversed(chapter.parts), quick=True) == chapter.chosen()


@pytest.mark.parametrize(("name", "count"), [("ch2", 44), ("ch4", 48), ("ch5", 21), ("testbed", 13)])
def test_every_claim_of_the_text_is_judged_by_one_function(name: str, count: int) -> None:
    (command,) = (each for each in COMMANDS if each.name == name)
    claims = command.load().judged.claims
    printed = claims.printed()
    assert [claim.id[1:] for claim in printed] == [f"{number:02d}" for number in range(1, count + 1)]
    assert sorted(claims.judged) == [claim.id for claim in printed]
    assert all(claim.text and claim.figure and claim.unit for claim in printed)
    assert all(claim.paper == "yes" for claim in printed if claim.unit == "bool")


@pytest.mark.parametrize("item", items(), ids=lambda item: item.name)
def test_every_place_exists(item: Item) -> None:
    assert [place for place in item.places if not exists(place)] == []


def test_no_numbered_item_is_left_out_or_stands_twice() -> None:
    listed = [each for item in items() for each in numbers(item)]
    assert sorted(listed) == sorted((kind, number) for kind, known in NUMBERED.items() for number in known)


def test_a_place_that_is_not_there_is_noticed() -> None:
    for kind, name in (
        ("file", "cps_envs/no.py"),
        ("command", "nothing"),
        ("env", "Nothing-v0"),
        ("policy", "fdi.attacker.nobody"),
        ("preset", "fdi.nothing"),
        ("option", "fdi.nothing"),
        ("reproduce", "ch2 9.9"),
    ):
        assert not exists(Place(kind, name))


@pytest.mark.usefixtures("pages")
def test_the_generated_page_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert docs.main(["--check"]) == 0, capsys.readouterr().err


@pytest.mark.usefixtures("pages")
def test_an_old_page_is_found_and_written_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = ["--to", str(tmp_path)]
    assert docs.main(["--check", *folder]) == 1
    assert "make pages" in capsys.readouterr().err
    assert docs.main(folder) == 0
    assert docs.main(["--check", *folder]) == 0


def test_a_role_has_a_page_with_everything_that_there_is_to_know(pages: dict[str, str]) -> None:
    page = pages["environments/DisbandingAttack.md"]
    for heading in ("Threat Model", "Action Space", "Observation Space", "Presets and Baselines"):
        assert f"\n## {heading}\n" in page
    for heading in ("Code to Start", "Rewards", "References", "Version History"):
        assert f"\n## {heading}\n" in page
    assert "\n## Presets\n" in pages["environments/disbanding.md"]  # both roles share them
    assert "{" not in page.partition("## Arguments")[0].replace("{table}", "")
    assert "| 0-9 | `mean_speed` |" in page
    assert "`vehicle_0` to `vehicle_99`" in pages["environments/DisbandingDefense.md"]


def test_pictures_of_the_pages_are_there_and_small(pages: dict[str, str]) -> None:
    for problem in PROBLEMS:
        film = docs.FOLDER / "images" / f"{problem}.gif"
        assert 10_000 < film.stat().st_size < 2_000_000
        root = ElementTree.fromstring(pages[f"images/{problem}-loop.svg"])
        assert root.attrib["aria-label"]


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("myst_nb", reason="needs sphinx and myst-nb, which build the site")
    pytest.importorskip("furo", reason="needs furo, the style of the site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    command += ["-D", "nb_execution_mode=off", str(docs.FOLDER), str(tmp_path)]  # tests/test_pages.py runs notebooks
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert (tmp_path / "environments" / "RogueDefense.html").is_file()
