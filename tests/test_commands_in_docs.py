"""Every command that a page shows exists, with its options."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

typer_main = pytest.importorskip("typer.main", reason="needs the command line")

from cps_agents.cli import app  # noqa: E402

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb")])
COMMAND = re.compile(r"(?:^|`|\$ )(?:CPS_ENVS_\w+=\S+ |PYTHONPATH=\S+ )?cps-envs ([^`\n]+)", re.MULTILINE)
HISTORY = ROOT / "CHANGELOG.md"  # names what was
PLACEHOLDERS = re.compile(r"\.\.\.|…|\[[A-Z]|\||--[A-Z]|DIR|NAME|FILE|PROBLEM")


def written(page: Path) -> str:
    """The text of a page, or of a notebook's cells."""
    text = page.read_text(encoding="utf-8")
    if page.suffix != ".ipynb":
        return text
    return "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])


def commands(page: Path) -> Iterator[str]:
    """What follows `cps-envs` on a page, without comments and what only stands for something."""
    text = re.sub(r"\\\n\s*", " ", written(page))
    for found in COMMAND.findall(text):
        words = re.split(r"\s+#\s", found)[0].rstrip(" ,.;:)")
        if re.match(r"[a-z-]", words) and not PLACEHOLDERS.search(words):
            yield words


@pytest.mark.parametrize("page", [page for page in PAGES if page != HISTORY], ids=lambda page: page.name)
def test_the_commands_of_a_page_exist(page: Path) -> None:
    for words in commands(page):
        try:
            arguments = shlex.split(words)
        except ValueError:
            continue  # a quotation that the page breaks off
        parse(arguments, words)


def parse(arguments: list[str], words: str) -> None:
    """Read a command line without running it."""
    command = typer_main.get_command(app)
    while subcommands := getattr(command, "commands", None):
        while arguments and arguments[0] in ("--trust", "--debug"):
            arguments = arguments[1:]
        if not arguments or arguments[0].startswith("--"):
            return
        name, *arguments = arguments
        assert name in subcommands, f"there is no command `cps-envs {words}`"
        command = subcommands[name]
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    for argument in arguments:
        option = argument.partition("=")[0]
        if re.fullmatch(r"--[a-z][a-z-]*", option):
            assert option in known | {"--help"}, f"`cps-envs {words}`: there is no {option}"


def test_commands_are_found_on_pages() -> None:
    assert sum(len(list(commands(page))) for page in PAGES) > 100
