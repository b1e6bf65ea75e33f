"""The report in a real browser: it draws, sorts, plays to the end, fits a phone and obeys the keyboard."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cps_agents.report.report import write_page

pytestmark = pytest.mark.browser
NAMES = ("chromium", "chromium-browser", "google-chrome")
DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
PLAYERS = ("--attacker", "square", "--attacker", "none", "--defender", "sliding", "--defender", "monitor")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """The Chromium of this machine."""
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install --group browser")
    path = os.environ.get("CPS_ENVS_BROWSER") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(f"no browser was found: install chromium, or name one in CPS_ENVS_BROWSER (looked for {NAMES})")
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report with two episodes to watch for each pair, a learning curve and a table of the paper."""
    from cps_agents.cli import app

    here = tmp_path_factory.mktemp("report")
    run = here / "runs" / "mine" / "seed-0"
    run.mkdir(parents=True)
    rows = [f'{{"steps": {512 * k}, "validation": {k % 7}}}\n' for k in range(30)]
    (run / "evaluations.jsonl").write_text("".join(rows))
    (here / "paper").mkdir()
    (here / "paper" / "claims.csv").write_text("claim,paper,ours,verdict\nR1,1.0,1.02,reproduced\n")
    arguments = [
        "report",
        "rogue",
        *PLAYERS,
        "--set",
        "duration_s=9",
        "--episodes",
        "3",
        "--replays",
        "2",
        "--jobs",
        "1",
    ]
    places = ["--out", str(here / "out"), "--meetings", str(here / "kept"), "--runs", str(here / "runs")]
    result = CliRunner().invoke(app, [*arguments, *places, "--jobs", "1", "--paper", str(here / "paper")])
    assert result.exit_code == 0, result.output
    return here / "out" / "index.html"


def opened(browser: Any, page_file: Path, size: dict[str, int], **options: Any) -> Any:
    page = browser.new_page(viewport=size, **options)
    page.problems = []
    page.on("console", lambda message: page.problems.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.problems.append(str(error)))
    page.on("request", lambda request: page.problems.append(request.url) if request.url.startswith("http") else None)
    page.goto(page_file.as_uri())
    page.wait_for_selector("button.cell")
    return page


@pytest.fixture
def page(browser: Any, page_file: Path) -> Iterator[Any]:
    """The report on a desk, which has to stay without errors and without the network."""
    found = opened(browser, page_file, DESK)
    yield found
    assert found.problems == []
    found.close()


def first_column(page: Any) -> list[str]:
    texts: list[str] = page.locator(".matrix tbody th button > span").all_text_contents()
    return [text.split(" ")[0] for text in texts[:-1]]


def ink(page: Any) -> int:
    """How many pixels of the picture are not of its ground."""
    counted: int = page.evaluate("""() => {
      const canvas = document.querySelector(".picture");
      const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      let count = 0;
      for (let k = 0; k < data.length; k += 4) count += data[k] < 200;
      return count;
    }""")
    return counted


def test_it_shows_matrix_curves_and_paper(page: Any) -> None:
    assert page.locator("button.cell").count() == 4
    assert page.locator("#learning polyline").count() == 1
    assert page.locator("#paper td.good").text_content() == "reproduced"


def test_it_begins_at_its_top_with_a_pair_to_watch(page: Any) -> None:
    assert page.locator(".pair").count() == 1
    assert page.locator(".cell[aria-pressed=true]").count() == 1
    assert page.evaluate("[scrollY, location.hash]") == [0, ""]
    assert page.get_by_text("Click a cell to watch its episodes").count() == 1


def test_columns_and_rows_sort(page: Any) -> None:
    button = page.locator('[data-sort="rows name"]')
    button.click()
    assert first_column(page) == ["none", "square"]
    button.click()
    assert first_column(page) == ["square", "none"]
    assert page.locator('th[aria-sort="descending"]').count() >= 1
    page.locator('[data-sort="rows 0"]').click()
    page.locator('[data-sort="columns 0"]').click()


def test_every_metric_can_be_shown(page: Any) -> None:
    values = page.locator(".bar select option").evaluate_all("options => options.map((each) => each.value)")
    assert "damage" in values
    for value in values:
        page.locator(".bar select").select_option(value)
        assert page.locator(".matrix tbody tr").count() == 3


def test_an_episode_plays_to_its_end(page: Any) -> None:
    page.locator("button.cell").first.click()
    page.wait_for_selector(".picture")
    page.wait_for_timeout(200)
    assert ink(page) > 2000
    page.locator(".controls select").select_option("4")
    page.locator(".play").click()
    page.wait_for_function(
        "(() => { const i = document.querySelector('.controls input'); return i.value === i.max; })()"
    )
    page.wait_for_function("document.querySelector('.play').textContent === 'Play'")
    assert page.locator(".chip").count() == 2
    page.locator(".chip").nth(1).click()
    page.wait_for_selector(".chip[aria-pressed=true] >> nth=0")


def test_time_lines_move_with_the_picture_and_lead_to_moments(page: Any) -> None:
    page.locator(".cell[aria-label^='square against monitor']").click()
    page.wait_for_selector(".track")
    assert page.get_by_text("What the defender believed").count() == 1
    assert page.locator(".about code", has_text="apart").count() == 1
    assert "`" not in page.locator(".pair").inner_text()
    page.get_by_text("What the attacker saw").click()
    plot = page.locator(".track .plot").first
    box = plot.bounding_box()
    plot.click(position={"x": box["width"] / 2, "y": 10})
    slider = page.locator(".controls input")
    half = int(slider.get_attribute("max")) / 2
    assert abs(int(slider.input_value()) - half) <= 2
    share = float(page.locator(".tracks").evaluate("each => each.style.getPropertyValue('--at')"))
    assert share == pytest.approx(0.5, abs=0.05)


def test_the_keyboard_is_enough(page: Any) -> None:
    page.locator(".cell[tabindex='0']").focus()
    before = page.evaluate("document.activeElement.ariaLabel")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.ariaLabel") != before
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    page.keyboard.press("Enter")
    page.wait_for_selector(".player")
    page.locator(".player").focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert page.locator(".controls input").input_value() == "3"
    page.keyboard.press("End")
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    assert page.locator(".play").text_content() == "Pause"
    page.keyboard.press(" ")
    assert page.locator(".play").text_content() == "Play"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone(scheme: str, browser: Any, page_file: Path) -> None:
    page = opened(browser, page_file, PHONE, color_scheme=scheme)
    page.locator("button.cell").last.click()
    page.wait_for_selector(".picture")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.locator(".controls .play").bounding_box()["height"] >= 36
    assert page.problems == []
    page.close()


def test_cells_differ_in_more_than_hue(page: Any) -> None:
    shares = page.locator(".cell").evaluate_all(
        "cells => cells.map((each) => Number(each.style.getPropertyValue('--share')))"
    )
    assert (min(shares), max(shares)) == (0, 1)
    widths = page.locator(".cell").evaluate_all(
        "cells => cells.map((each) => getComputedStyle(each).backgroundSize.split(' ')[0])"
    )
    assert len(set(widths)) > 1  # of the bars


def test_a_missing_episode_is_told(browser: Any, page_file: Path, tmp_path: Path) -> None:
    alone = tmp_path / "index.html"
    alone.write_bytes(page_file.read_bytes())
    page = opened(browser, alone, DESK)
    page.locator("button.cell").first.click()
    page.get_by_text("This episode cannot be shown").wait_for()
    page.close()


HOSTILE = (
    "<!-- <script> --> </script><script>window.ran = 1</script><img src=x onerror='window.ran = 2'>"
    "\"'`${window.ran = 3}{{7*7}} @content@ @title@ \u2028 \\u003c <\\!-- & &lt; javascript:window.ran=4"
)


def test_every_text_may_be_hostile(browser: Any, page_file: Path, tmp_path: Path) -> None:
    """The page shows the texts as they are, all of its content, and runs none of them."""
    found = re.search(r'id="content">(.*?)</script>', page_file.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    content = spoiled(json.loads(found[1]))
    page = opened(browser, write_page(tmp_path, content), DESK)
    shown = page.locator("body").inner_text()
    assert page.title() == content["title"]
    assert shown.count("window.ran = 1") > 10
    assert page.locator("#paper td").all_text_contents() == content["sheets"][0]["rows"][0][1:]
    assert page.locator("button.cell").count() == 4
    assert page.locator("#learning polyline").count() == 1
    assert page.evaluate("document.scripts.length") == 3  # its own two, and the episode that is open
    for cell in page.locator("button.cell").all():
        cell.click()
        page.get_by_text("This episode cannot be shown").first.wait_for()  # its file is not beside this page
    assert page.evaluate("[window.ran, document.images.length]") == [None, 0]
    page.close()


def spoiled(content: dict[str, Any]) -> dict[str, Any]:
    """The content with every text that somebody may write made hostile; keys of episodes and metrics stay."""
    return {name: _spoiled(value) for name, value in content.items()}


KEPT = ("cells", "role", "problem", "kind")  # what the program looks up, and no text to read


def _spoiled(value: Any) -> Any:
    if isinstance(value, str):
        return f"{value}{HOSTILE}"
    if isinstance(value, list):
        return [_spoiled(each) for each in value]
    if isinstance(value, dict):
        return {name: each if name in KEPT else _spoiled(each) for name, each in value.items()}
    return value


def test_pictures_for_the_site_show_the_pair_that_is_asked_for(browser: Any, page_file: Path, tmp_path: Path) -> None:
    arguments = (str(page_file), "rogue/square/monitor", str(tmp_path))
    script = [sys.executable, "-m", "tools.pages.screenshots"]  # Playwright runs once in a process
    assert subprocess.run([*script, *arguments], check=False).returncode == 0
    for name in ("report.png", "report-phone.png"):
        assert 20_000 < (tmp_path / name).stat().st_size < 400_000
    bare = page_file.with_name("none.html")
    bare.write_text("nothing")
    refused = subprocess.run([*script, str(bare), *arguments[1:]], capture_output=True, text=True, check=False)
    assert (refused.returncode, "has no episode of" in refused.stderr) == (2, True)
