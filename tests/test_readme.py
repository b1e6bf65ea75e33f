"""Every snippet of the pages that a newcomer reads first runs as printed, and every table is one."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FIRST = README + (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
ADDRESS = "https://github.com/cps-envs/cps-envs/blob/main/"
RAW = "https://raw.githubusercontent.com/cps-envs/cps-envs/main/"
PYTHON = list(dict.fromkeys(re.findall(r"```python\n(.*?)```", FIRST, re.DOTALL)))
LINES = [
    line.removeprefix("$ ")
    for block in re.findall(r"```console\n(.*?)```", FIRST, re.DOTALL)
    for line in block.splitlines()
]
COMMANDS = [line for line in dict.fromkeys(LINES) if line.startswith("cps-envs ")]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
WORDS = 700


@pytest.mark.parametrize("snippet", PYTHON, ids=lambda text: text.strip().splitlines()[-1][:40])
def test_python_snippets_run(snippet: str, tmp_path: Path) -> None:
    if "stable_baselines3" in snippet:
        pytest.importorskip("stable_baselines3")
    run([sys.executable, "-c", snippet], tmp_path)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_run(command: str, tmp_path: Path) -> None:
    run([sys.executable, "-c", "from cps_agents.cli import main; main()", *shlex.split(command)[1:]], tmp_path)


def test_there_are_snippets_of_both_kinds() -> None:
    assert len(PYTHON) >= 3
    assert len(COMMANDS) >= 4


def test_the_first_page_is_short() -> None:
    assert len(README.split()) <= WORDS


def test_its_links_lead_to_files_from_anywhere() -> None:
    links = re.findall(r"\]\(([^)]+)\)", README)
    assert links
    for link in links:
        assert link.startswith("https://"), "the index of packages shows this page without the repository"
        for address in (ADDRESS, RAW):
            if link.startswith(address):
                assert (ROOT / link.removeprefix(address)).exists(), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_tables_are_rendered_as_tables(page: Path) -> None:
    markdown = pytest.importorskip("markdown_it", reason="needs markdown-it, which renders pages")
    html = markdown.MarkdownIt("commonmark").enable("table").render(page.read_text(encoding="utf-8"))
    text = re.sub(r"<pre>.*?</pre>", "", html, flags=re.DOTALL)
    torn = [line for line in text.splitlines() if re.match(r"(<p>)?\|.*\|(</p>)?$", line)]
    assert not torn, f"a table is cut: {torn[0][:80]}"


def run(command: list[str], folder: Path) -> None:
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-4000:]
