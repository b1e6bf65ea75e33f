"""What the house was to become, beside what it is: `python -m tools.census` prints a line for each figure.

The figures are signs of concepts that are gone, not goals. Lines are those of Python files; words are those of pages
without code and tables' rules.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from cps_agents.cli import COMMANDS, whole
from cps_agents.console import out
from cps_agents.table import Cell, Table, styled
from tools.freeze import said

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "cps_envs": ROOT / "cps_envs",
    "cps_baselines": ROOT / "baselines" / "cps_baselines",
    "cps_agents": ROOT / "agents" / "cps_agents",
    "cps_paper": ROOT / "paper" / "cps_paper",
}
JUDGING = (  # what lets policies meet and says what came out
    "agents/cps_agents/arena",
    "agents/cps_agents/evaluation.py",
    "agents/cps_agents/league",
    "agents/cps_agents/scoring",
    *(
        f"agents/cps_agents/commands/{name}.py"
        for name in ("best_response", "evaluate", "league", "score", "self_play")
    ),
    "baselines/cps_baselines/arena.py",
    "baselines/cps_baselines/contest.py",
    "baselines/cps_baselines/tracks.py",
    *(f"baselines/cps_baselines/{name}/contest.py" for name in ("disbanding", "fdi", "hvac", "rogue")),
    *(f"baselines/cps_baselines/{name}/tracks.py" for name in ("disbanding", "fdi", "hvac", "rogue")),
    "paper/cps_paper/benchmark",
    "paper/cps_paper/commands/benchmark.py",
    *(f"paper/cps_paper/{name}/benchmark.py" for name in ("disbanding", "fdi", "hvac", "rogue")),
)
DECLARING = (
    "Block",
    "Contest",
    "Comparison",
    "Exhibit",
    "Plan",
    "Setting",
    "Suite",
    "Track",
)  # classes: a table as data
SEARCHED = "box_in"  # a policy with searched numbers, whose files are counted
FILTERS = re.compile(r"kalman|filter", re.IGNORECASE)


@dataclass(frozen=True)
class Figure:
    """One figure: what was wanted and what is."""

    what: str
    before: str
    wanted: str
    reached: str
    met: bool | None = None  # None: nothing to compare


def figures() -> Iterator[Figure]:
    """All of them."""
    sizes = {name: lines_of(python_files(folder)) for name, folder in PACKAGES.items()}
    paper = sizes.pop("cps_paper")
    yield most("wheel without cps_paper, lines", 68_700, 44_000, sum(sizes.values()))
    yield most("wheel and cps_paper, lines", 68_700, 50_000, sum(sizes.values()) + paper)
    judging = [file for place in JUDGING for file in python_files(ROOT / place)]
    yield most("judging, lines", 10_300, 6_500, lines_of(judging))
    yield most("judging, classes", 86, 45, len([name for file in judging for name in classes_of(file)]))
    declared = sorted({name for file in shipped() for name in classes_of(file)} & set(DECLARING))
    yield most(f"ways to declare a table ({', '.join(declared)})", 5, 2, len(declared))
    yield most("files that run CMA-ES", 11, 1, len(naming(r"\bcma\.\w|import cma\b|\.ask\(\)")))
    yield most(f"files that name the searched policy {SEARCHED}", 11, 5, len(naming(rf"\b{SEARCHED}\b|box-in")))
    yield most("commands", 37, 16, len(COMMANDS))
    yield most("parameters of commands", 326, 326, sum(parameters(each) for each in whole().commands.values()))
    yield most("lines of `cps-envs list`", 130, 24, said("list").count("\n"))
    commands = [*python_files(PACKAGES["cps_agents"] / "commands"), *python_files(PACKAGES["cps_paper"] / "commands")]
    yield most("imports inside functions of commands", 265, 0, sum(map(inner_imports, commands)))
    yield most("circles of imports", 1, 0, len(circles()))
    names = Counter(name for file in shipped() for name in classes_of(file) if not name.startswith("_"))
    yield most("class names used twice", 72, 25, sum(count > 1 for count in names.values()))
    yield most("modules of filters", 6, 1, len([file for file in shipped() if FILTERS.search(file.stem)]))
    viewers = [file for file in python_files(ROOT / "cps_envs") if "picture" in file.parts and "core" not in file.parts]
    yield most("viewers of problems, lines", 3_354, 2_200, lines_of(viewers))
    pages = {page.stem: words_of(page) for page in sorted((ROOT / "docs").rglob("*.md"))}
    user = {name: count for name, count in pages.items() if name in user_pages()}
    yield most(f"words of {len(user)} pages for users", 122_000, 35_000, sum(user.values()))
    games = {name: user.get(name, pages[name]) for name in ("disbanding", "fdi", "hvac", "rogue")}
    longest = max(games, key=lambda name: games[name])
    yield most(f"words of the longest page of a game ({longest})", 12_000, 2_500, games[longest])
    yield most("tests, lines", 31_500, 25_000, lines_of(python_files(ROOT / "tests")))
    yield Figure("tools, lines", "-", "-", f"{lines_of(python_files(ROOT / 'tools')):,}")


def most(what: str, before: int, wanted: int, reached: int) -> Figure:
    """A figure that was to be no larger than this."""
    return Figure(what, f"{before:,}", f"{wanted:,}", f"{reached:,}", reached <= wanted)


def python_files(place: Path) -> list[Path]:
    """The Python files of a folder, or the file itself; nothing where there is none."""
    return [place] if place.suffix == ".py" and place.is_file() else sorted(place.rglob("*.py"))


def shipped() -> list[Path]:
    """The files of all packages."""
    return [file for folder in PACKAGES.values() for file in python_files(folder)]


def lines_of(files: Sequence[Path]) -> int:
    """Lines, empty ones included."""
    return sum(text_of(file).count("\n") for file in files)


@cache
def text_of(file: Path) -> str:
    """Its text."""
    return file.read_text(encoding="utf-8")


@cache
def tree_of(file: Path) -> ast.Module:
    """Its syntax."""
    return ast.parse(text_of(file))


def classes_of(file: Path) -> list[str]:
    """The classes that a file defines."""
    return [node.name for node in ast.walk(tree_of(file)) if isinstance(node, ast.ClassDef)]


def naming(pattern: str) -> list[Path]:
    """Files of the packages and pyproject.toml in which something is named."""
    known = re.compile(pattern)
    return [file for file in (*shipped(), ROOT / "pyproject.toml") if known.search(text_of(file))]


def parameters(command: object) -> int:
    """The options and arguments of a command and of those below it."""
    below = getattr(command, "commands", {}).values()
    return len(getattr(command, "params", ())) + sum(map(parameters, below))


def inner_imports(file: Path) -> int:
    """Import statements inside functions."""
    functions = [node for node in ast.walk(tree_of(file)) if isinstance(node, ast.FunctionDef)]
    imports = {
        id(node) for each in functions for node in ast.walk(each) if isinstance(node, ast.Import | ast.ImportFrom)
    }
    return len(imports)


def circles() -> list[set[str]]:
    """Groups of modules that import each other, at the top or inside functions."""
    modules = {module_of(file): file for file in shipped()}
    graph = {name: imported(file, modules) - {name} for name, file in modules.items()}
    reach = {name: reachable(graph, name) for name in graph}
    groups = {frozenset(other for other in reach[name] if name in reach[other]) for name in graph}
    return [set(group) for group in groups if len(group) > 1]


def module_of(file: Path) -> str:
    """Its name for `import`."""
    folder = next(folder for folder in PACKAGES.values() if file.is_relative_to(folder))
    return ".".join(file.relative_to(folder.parent).with_suffix("").parts).removesuffix(".__init__")


def imported(file: Path, modules: dict[str, Path]) -> set[str]:
    """Modules of ours that a file imports when it is loaded or runs, but not for types alone."""
    typed = {
        id(inside)
        for node in ast.walk(tree_of(file))
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        for inside in ast.walk(node)
    }
    found = set()
    for node in ast.walk(tree_of(file)):
        if id(node) in typed or not isinstance(node, ast.ImportFrom) or node.module is None:
            continue
        for each in node.names:
            whole_name = f"{node.module}.{each.name}"
            found.add(whole_name if whole_name in modules else node.module)
    return found & set(modules)


def reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    """Everything that is imported from a module on."""
    seen: set[str] = set()
    left = list(graph[start])
    while left:
        name = left.pop()
        if name not in seen:
            seen.add(name)
            left += graph[name]
    return seen


def user_pages() -> set[str]:
    """The names of the pages that the index lists before evidence and developers' pages."""
    index = text_of(ROOT / "docs" / "index.md")
    parts = re.findall(r":caption: ([^\n]+)\n(.*?)```", index, re.DOTALL)
    shown = [listed for caption, listed in parts if caption.strip() not in ("Evidence", "Developers", "Development")]
    return {line.strip().rpartition("/")[2] for listed in shown for line in listed.splitlines() if line.strip()}


def words_of(page: Path) -> int:
    """Words of a page without its code."""
    text = re.sub(r"```.*?```", "", text_of(page), flags=re.DOTALL)
    return len(re.findall(r"\w[\w'.,-]*", text))


def main() -> None:
    """Print the table."""
    found = list(figures())
    rows = [
        (each.what, each.before, each.wanted, each.reached, "" if each.met is None else verdict(each.met))
        for each in found
    ]
    out().print(Table("The house: before, wanted, reached", ("", "before", "wanted", "reached", ""), rows))


def verdict(met: bool) -> Cell:
    """A word for the table."""
    return styled("met", "green") if met else styled("missed", "red")


if __name__ == "__main__":
    main()
