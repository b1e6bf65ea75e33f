"""What pages show is so: snippets and commands run, options exist, links lead somewhere, tables are whole."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from cps_envs import PROBLEMS
from tests.turns import slow

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
README = (ROOT / "README.md").read_text(encoding="utf-8")
FIRST = README + (DOCS / "start.md").read_text(encoding="utf-8")  # the pages that a newcomer reads first
SNIPPET = re.compile(r"```python\n(.*?)```", re.DOTALL)
OWN = (DOCS / "own_system.md").read_text(encoding="utf-8")
PYTHON = list(dict.fromkeys(re.sub(r"  # .*", "", snippet) for snippet in SNIPPET.findall(FIRST + OWN)))
GAMES = {
    name: {
        f"{page.parent.name}/{page.name}, snippet {place}": snippet
        for page in (DOCS / f"{name}.md", DOCS / "details" / f"{name}.md")
        for place, snippet in enumerate(SNIPPET.findall(page.read_text(encoding="utf-8")))
    }
    for name in PROBLEMS
}
LINES = [
    line.removeprefix("$ ")
    for block in re.findall(r"```console\n(.*?)```", FIRST, re.DOTALL)
    for line in block.splitlines()
]
COMMANDS = [line for line in dict.fromkeys(LINES) if line.startswith("cps-envs ")]
LESS = {  # the same with less work, for the tests that are not slow
    r"total_timesteps=[\d_]+": "total_timesteps=2_000",
    r"range\(((?:\d+_)+000), [\d_]+\)": r"range(\1, \1 + 4)",  # seeds of episodes
    r"range\(100\)": "range(4)",
    r"--episodes \d+": "--episodes 2",
    r"(play (?!.*duration_s).*--render .*)": r"\1 --set duration_s=10",
    r"(report .*)": r"\1 --set duration_s=2 --jobs 1",
    r"(league .*)": r"\1 --attacker random --attacker square --defender none --defender pd --jobs 1",
    r"(evaluate .*)": r"\1 --jobs 1",
    r"(score (?!.*--dev).*)": r"\1 --dev",
}
NOTEBOOKS = sorted((DOCS / "tutorials").glob("*.ipynb"))
TABLED = sorted([ROOT / "README.md", *DOCS.rglob("*.md")])
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")])
HISTORY = ROOT / "CHANGELOG.md"  # names what was
COMMAND = re.compile(r"(?:^|`|\$ )(?:CPS_ENVS_\w+=\S+ |PYTHONPATH=\S+ )?cps-envs ([^`\n]+)", re.MULTILINE)
PLACEHOLDERS = re.compile(r"\.\.\.|…|\[[A-Z]|\||--[A-Z]|DIR|NAME|FILE|PROBLEM")
WORDS = 700
EACH_NOTEBOOK = pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)


def shortened(text: str) -> str:
    """A snippet or a command with less work to do."""
    for long, short in LESS.items():
        text = re.sub(long, short, text)
    return text


SHORT = [pytest.param(shortened, id="short"), pytest.param(str, marks=pytest.mark.slow, id="as-printed")]
TRAINED = [line for line in COMMANDS if "sb3:" in line]  # what they play is trained on the page
ALONE = [line for line in COMMANDS if line not in TRAINED]
RUNS = [  # the same command twice is run once
    *(pytest.param(command, id=command) for command in dict.fromkeys(map(shortened, ALONE))),
    *(pytest.param(command, id=f"{command}-as-printed", marks=pytest.mark.slow) for command in ALONE),
]


def run(folder: Path, code: str, *arguments: str) -> None:
    """Run Python code in a process of its own, with `arguments` of the interpreter or the program."""
    for package in ("stable_baselines3", "minari"):
        if package in code:
            pytest.importorskip(package)
    options = [each for each in arguments if each.startswith("-W")]
    command = [sys.executable, *options, "-c", code, *(each for each in arguments if each not in options)]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=1800, check=False)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-4000:]


def run_command(folder: Path, command: str) -> None:
    run(folder, "from cps_agents.cli import main; main()", *shlex.split(command)[1:])


def cells(notebook: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return found


@pytest.fixture(scope="module", params=SHORT)
def change(request: pytest.FixtureRequest) -> Any:
    """What becomes of a text before it is run."""
    return request.param


@pytest.mark.parametrize("snippet", PYTHON, ids=lambda text: text.strip().splitlines()[-1][:40])
def test_python_snippets_run(snippet: str, change: Callable[[str], str], tmp_path: Path) -> None:
    """And the commands that play what a snippet trains."""
    run(tmp_path, change(snippet))
    if "model.learn" in snippet:
        for command in dict.fromkeys(map(change, TRAINED)):
            if change is str or " score " not in command:  # scores play thousands of episodes
                run_command(tmp_path, command)


@pytest.mark.parametrize("game", GAMES)
def test_snippets_of_the_pages_of_a_game_run_without_a_warning(game: str, tmp_path: Path) -> None:
    code = [
        f"exec(compile({code!r}, {name!r}, 'exec'), {{'__name__': '__main__'}})" for name, code in GAMES[game].items()
    ]
    run(tmp_path, "\n".join(code), "-Werror")


@pytest.mark.parametrize("command", RUNS)
def test_commands_run(command: str, tmp_path: Path) -> None:
    run_command(tmp_path, command)


TRAINING = ("learn_from_data", "train_and_judge", "your_own_house")  # notebooks that take many seconds even shortened
RUN_NOTEBOOK = [slow(notebook) if notebook.stem in TRAINING else notebook for notebook in NOTEBOOKS]


@pytest.mark.parametrize("notebook", RUN_NOTEBOOK, ids=lambda notebook: notebook.stem)
def test_a_notebook_runs(notebook: Path, change: Callable[[str], str], tmp_path: Path) -> None:
    code = "\n".join("".join(cell["source"]) for cell in cells(notebook) if cell["cell_type"] == "code")
    run(tmp_path, change(code))


@EACH_NOTEBOOK
def test_a_notebook_is_kept_without_what_it_printed(notebook: Path) -> None:
    assert not [cell for cell in cells(notebook) if cell.get("outputs") or cell.get("execution_count")]


def test_the_first_page_is_short() -> None:
    assert sum(any(map(str.isalnum, word)) for word in README.split()) <= WORDS  # without the marks of tables


@pytest.mark.parametrize("page", TABLED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not link.startswith(("https://", "http://")):
            assert (page.parent / link).exists(), link


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and the site name them; of a page that includes another, its."""
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"^```\{include\} (\S+)$", text, re.MULTILINE):
        text += (page.parent / name).read_text(encoding="utf-8")
    headings = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE)
    plain = (re.sub(r"\]\([^)]*\)|[^\w\s-]", "", heading).strip().lower() for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", [page for page in PAGES if page != HISTORY], ids=lambda page: page.name)
def test_links_lead_to_headings_and_stay_in_the_repository(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        text = "\n".join("".join(cell["source"]) for cell in cells(page))
    text = re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)
    for link, heading in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", text):
        if link.startswith(("https://", "http://")):
            assert not re.search(r"github\.com/cps-envs|cps-envs\.github\.io", link) or "colab" in link, (
                f"relative: {link}"
            )
            continue
        place = page.parent / link if link else page
        assert place.exists(), link
        if heading and place.suffix == ".md":
            assert heading in anchors(place), f"{link}#{heading}"


@EACH_NOTEBOOK
def test_a_notebook_opens_in_colab(notebook: Path) -> None:
    """A badge below the title, and a first cell that installs what the others import."""
    first, install, *others = cells(notebook)
    assert (
        f"](https://colab.research.google.com/github/cps-envs/cps-envs/blob/main/docs/tutorials/{notebook.name})"
        in ("".join(first["source"]))
    )
    extras = re.search(r'"cps-envs\[([a-z0-9,]+)\]"', "".join(install["source"]))
    assert extras
    code = "\n".join("".join(cell["source"]) for cell in others if cell["cell_type"] == "code")
    for module, extra in {"torch": ("train", "sb3"), "stable_baselines3": ("sb3",), "minari": ("data",)}.items():
        assert not re.search(rf"^(import|from) {module}", code, re.MULTILINE) or set(extra) & set(extras[1].split(","))


@pytest.mark.parametrize("page", TABLED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_tables_are_rendered_as_tables(page: Path) -> None:
    markdown = pytest.importorskip("markdown_it", reason="needs markdown-it, which renders pages")
    html = markdown.MarkdownIt("commonmark").enable("table").render(page.read_text(encoding="utf-8"))
    text = re.sub(r"<pre>.*?</pre>", "", html, flags=re.DOTALL)
    torn = [line for line in text.splitlines() if re.match(r"(<p>)?\|.*\|(</p>)?$", line)]
    assert not torn, f"a table is cut: {torn[0][:80]}"


def commands(page: Path) -> Iterator[str]:
    """What follows `cps-envs` on a page or in a notebook, without comments and what only stands for something."""
    notebook = page.suffix == ".ipynb"
    text = "\n".join("".join(cell["source"]) for cell in cells(page)) if notebook else page.read_text(encoding="utf-8")
    for found in COMMAND.findall(re.sub(r"\\\n\s*", " ", text)):
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


@pytest.mark.parametrize(
    "page", [*(page for page in PAGES if page != HISTORY), ROOT / "Makefile"], ids=lambda page: page.name
)
def test_the_modules_that_a_page_runs_exist(page: Path) -> None:
    for module in re.findall(r"python -m ((?:tools|cps_\w+)[\w.]*\w)", page.read_text(encoding="utf-8")):
        assert find_spec(module) is not None, module
        assert find_spec(module).submodule_search_locations is None or find_spec(f"{module}.__main__"), module


@cache
def command_line() -> Any:
    pytest.importorskip("typer", reason="needs the command line")
    from cps_agents.cli import whole

    return whole()


def parse(arguments: list[str], words: str) -> None:
    """Read a command line without running it."""
    command = command_line()
    while hasattr(command, "resolve_command"):
        while arguments and arguments[0] in ("--trust", "--debug"):
            arguments = arguments[1:]
        if not arguments or arguments[0].startswith("--"):
            return
        try:  # as the command line itself does, which adds the name of a command that may be left out
            _, command, arguments = command.resolve_command(command.context_class(command), arguments)
        except Exception as error:
            pytest.fail(f"there is no command `cps-envs {words}`: {error}")
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    for argument in arguments:
        option = argument.partition("=")[0]
        if re.fullmatch(r"--[a-z][a-z-]*", option):
            assert option in known | {"--help"}, f"`cps-envs {words}`: there is no {option}"


def test_there_is_something_of_each_kind() -> None:
    assert len(PYTHON) >= 2
    assert sum(map(len, GAMES.values())) >= 2 * len(PROBLEMS)
    assert len(COMMANDS) >= 4
    assert len(TRAINED) >= 2
    assert sum("model.learn" in snippet for snippet in PYTHON) == 1
    assert len(NOTEBOOKS) >= 5
    assert sum(len(list(commands(page))) for page in PAGES) > 100
