"""What the house was to become, beside what it is: `python -m tools.census` prints a line for each figure.

The figures are signs of concepts that are gone, not goals. All are counted from the tree when the command runs, but the
CPU time of `make test-quick`, which `--tests` measures. A place that has moved is an error, not a smaller number.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from cps_agents.cli import COMMANDS, whole
from cps_agents.console import out
from cps_agents.sheet import Cell, Sheet, styled
from tools.counting import (
    PACKAGES,
    ROOT,
    calls_of,
    circles,
    classes_of,
    files_at,
    inner_imports,
    lines_of,
    listed_below,
    naming,
    shipped,
    toctrees,
    words_of,
)
from tools.freeze import said

JUDGING = (  # what lets policies meet and says what came out
    "agents/cps_agents/arena",
    "agents/cps_agents/evaluation.py",
    "agents/cps_agents/league",
    "agents/cps_agents/scoring",
    *(
        f"agents/cps_agents/commands/{name}.py"
        for name in ("best_response", "evaluate", "league", "score", "self_play")
    ),
    "cps_envs/*/panels.py",
    "paper/cps_paper/benchmark",
    "paper/cps_paper/commands/benchmark.py",
    "paper/cps_paper/*/benchmark.py",
)
DECLARING = ("Block", "Comparison", "Contest", "Exhibit", "LeaguePlan", "Setting", "Suite", "Table", "Track")  # as data
SEARCHED = r"\bbox_in\b|BOXING_IN|boxing_in"  # a policy whose numbers were searched
PAGES = ("docs/rogue.md", "docs/details/rogue.md")
SHIPPING = (
    "pyproject.toml",
    "baselines",
    "agents",
    "paper",
    "tests",
    "tools/bench",
    *PAGES,
    "CHANGELOG.md",
)
BELOW = ("Evidence", "Developers")  # parts of the site that are no pages for users
GAMES = ("Disbanding", "Fdi", "Hvac", "Rogue")


@dataclass(frozen=True)
class Figure:
    """One figure: what it was, what was wanted and what is."""

    what: str
    before: int | None  # None: not counted then
    wanted: int | None  # None: nothing was
    reached: int | None  # None: not measured now

    @property
    def verdict(self) -> Cell:
        """Whether it is no larger than it was to be."""
        if self.wanted is None or self.reached is None:
            return ""
        return styled("met", "green") if self.reached <= self.wanted else styled("missed", "red")


def figures(*, tests: bool = False) -> list[Figure]:
    """All of them; with `tests` the quick tests are run."""
    return [*of_sizes(), *of_judging(), *of_commands(), *of_names(), *of_pages(), *of_tests(run=tests)]


def of_sizes() -> Iterator[Figure]:
    """Lines of Python, empty ones included."""
    sizes = {name: lines_of(files_at(str(folder.relative_to(ROOT)))) for name, folder in PACKAGES.items()}
    yield Figure("wheel without cps_paper, lines", 68_700, 44_000, sum(sizes.values()) - sizes["cps_paper"])
    yield Figure("wheel and cps_paper, lines", 68_700, 50_000, sum(sizes.values()))
    yield Figure("viewers of problems, lines", 3_354, 2_200, lines_of(files_at("cps_envs/[!c]*/picture")))
    yield Figure("tools, lines", None, None, lines_of(files_at("tools")))


def of_judging() -> Iterator[Figure]:
    """What judges, and what a policy that is shipped has to be told to."""
    judging = sorted({file for place in JUDGING for file in files_at(place)})
    yield Figure("judging, lines", 10_300, 6_500, lines_of(judging))
    yield Figure("judging, classes", 86, 45, sum(len(classes_of(file)) for file in judging))
    above = (file for file in shipped() if not file.is_relative_to(PACKAGES["cps_envs"]))  # games declare no tables
    known = sorted({name for file in above for name in classes_of(file)} & set(DECLARING))
    yield Figure(f"ways to declare a table: {', '.join(known)}", 5, 2, len(known))
    yield Figure("calls of CMA-ES", 11, 1, sum(calls_of(file, "CMAEvolutionStrategy") for file in shipped()))
    places = [file for place in SHIPPING for file in files_at(place)]
    yield Figure("files that name the searched policy box_in", 11, 5, len(naming(SEARCHED, places)))


def of_commands() -> Iterator[Figure]:
    """The command line."""
    files = [*files_at("agents/cps_agents/commands"), *files_at("paper/cps_paper/commands")]
    yield Figure("commands", 37, 16, len(COMMANDS))
    yield Figure("parameters of commands", 326, None, sum(map(parameters, whole().commands.values())))
    yield Figure("lines of `cps-envs list`", 130, 24, said("list").count("\n"))
    yield Figure("imports inside functions of commands", 265, 0, sum(map(inner_imports, files)))
    yield Figure("imports inside functions", 311, None, sum(map(inner_imports, shipped())))
    yield Figure("circles of imports", 1, 0, len(circles(inside=False)))
    yield Figure("circles of imports, those inside functions too", 1, None, len(circles(inside=True)))


def parameters(command: object) -> int:
    """The options and arguments of a command and of those below it."""
    below = getattr(command, "commands", {}).values()
    return len(getattr(command, "params", ())) + sum(map(parameters, below))


def of_names() -> Iterator[Figure]:
    """Names that stand for more than one class."""
    names = Counter(name for file in shipped() for name in classes_of(file) if not name.startswith("_"))
    yield Figure("class names used twice", 72, 25, sum(count > 1 for count in names.values()))
    filters = [file for file in shipped() if "kalman" in file.stem or "filter" in file.stem]
    yield Figure("modules of filters", 6, 1, len(filters))


def of_pages() -> Iterator[Figure]:
    """What users read: pages of the site that are neither evidence nor for developers."""
    parts = toctrees(ROOT / "docs" / "index.md")
    shown = [page for caption, pages in parts if caption not in BELOW for page in pages]
    below = {page for caption, pages in parts if caption in BELOW for each in pages for page in listed_below(each)}
    user = {page for each in shown for page in listed_below(each)} | {ROOT / "docs" / "index.md"}
    yield Figure("open entries of the sidebar", None, 12, sum(len(pages) for _, pages in parts))
    yield Figure(f"words of {len(user)} pages for users", 122_000, 35_000, sum(map(words_of, user)))
    yield Figure(f"words of {len(below)} other pages", None, None, sum(map(words_of, below)))
    games = [
        page
        for name in GAMES
        for page in (*files_at(f"docs/environments/{name}*.md"), *files_at(f"docs/{name.lower()}.md"))
    ]
    longest = max(games, key=words_of)
    yield Figure(f"words of a game's longest page: {longest.relative_to(ROOT)}", 12_000, 2_500, words_of(longest))


def of_tests(*, run: bool) -> Iterator[Figure]:
    """Lines of tests, and the CPU time of the quick ones."""
    yield Figure("tests, lines", 31_500, 25_000, lines_of(files_at("tests")))
    yield Figure("make test-quick, CPU s (--tests measures it)", None, 60, cpu_of_quick_tests() if run else None)


def cpu_of_quick_tests() -> int:
    """CPU seconds of `make test-quick`, user and system, with the processes that it starts."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(["make", "test-quick"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def main() -> None:
    """Print the table."""
    given = argparse.ArgumentParser(prog="python -m tools.census", description=__doc__)
    given.add_argument("--tests", action="store_true", help="run the quick tests and tell their CPU time")
    rows = [
        (each.what, *map(shown, (each.before, each.wanted, each.reached)), each.verdict)
        for each in figures(tests=given.parse_args().tests)
    ]
    out().print(Sheet("The house: before, wanted, reached", ("", "before", "wanted", "reached", ""), rows))


def shown(number: int | None) -> str:
    """With separators of thousands; a dash where there is none."""
    return "-" if number is None else f"{number:,}"


if __name__ == "__main__":
    main()
