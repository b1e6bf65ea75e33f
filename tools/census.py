"""How large the house is, beside how large it was: `python -m tools.census`, or `make census`.

Two tables. Figures are counted from the tree when the command runs, beside those of commit 821661fc, before the house
was cleared. Then every module, policy and preset that was to go: gone, or the user who would miss it.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cps_agents
import cps_baselines
import cps_envs
from cps_agents.cli import COMMANDS, whole
from cps_agents.console import out
from cps_agents.sheet import Cell, Sheet, styled
from cps_envs.core.policies.lookup import policy_names
from cps_envs.core.types import ROLES
from tools.counting import (
    PACKAGES,
    ROOT,
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

MODULES = (  # paths, of which none is to be there
    *("tools/rogue", "tools/double_oracle", "tools/recipes", "tools/remake", "tools/learnability"),
    *("tools/disbanding/yardsticks.py", "tools/hvac/calibrate.py", "tools/fdi/annealing.py", "tools/fdi/certify.py"),
    *("tools/reliability/mutation", "tools/reliability/fuzz/actions.py", "tools/reliability/fuzz/arguments.py"),
    *("tools/reliability/fuzz/misspelt.py", "tools/coverage", "tools/peers/checks"),
    *("tools/bench/against.py", "tools/bench/before.py", "tools/bench/threads.py", "tools/bench/resets.py"),
    *("tools/bench/learning.py", "agents/cps_agents/bench", "agents/cps_agents/commands/bench.py"),
    *("baselines/cps_baselines/rogue/boxing_in.py", "baselines/cps_baselines/rogue/beam.py"),
    *("baselines/cps_baselines/rogue/probing.py", "baselines/cps_baselines/rogue/probing.json"),
    *("baselines/cps_baselines/disbanding/replanning.py", "baselines/cps_baselines/hvac/opportunist.py"),
    *("baselines/cps_baselines/hvac/listener.py", "baselines/cps_baselines/hvac/shaped.py"),
    *("baselines/cps_baselines/fdi/planner.py", "baselines/cps_baselines/fdi/planning.py"),
    *("baselines/cps_baselines/fdi/shields.py", "baselines/cps_baselines/fdi/shield_policy.py"),
    *("baselines/cps_baselines/fdi/redundant.py", "baselines/cps_baselines/searches.py"),
    *("agents/cps_agents/learning/study.py", "agents/cps_agents/league/search.py", "agents/cps_agents/zoo/mixing.py"),
    *("agents/cps_agents/zoo/numbers.py", "agents/cps_agents/zoo/policies/parts", "cps_envs/testbed"),
    *("paper/cps_paper/commands/string_stability.py", "docs/tutorials/datasets"),
)
POLICIES = (
    *("box_in", "replanning", "opportunist", "listener", "shaped", "beam", "annealing", "shielded"),
    *("redundant_cusum", "probe"),
)
FDI_PRESETS = ("B", "C", "fig32", "five", "instability", "clip")
KEPT: dict[str, str] = {}  # what was to go and stays, with who would miss it
KNOBS = {"recent_s": 7, "rough_s": 7}  # each was to be declared once and used in few files
VALUES = ("problem.py", "learning.py")  # where a role sets them
BELOW = ("Evidence", "Developers")  # parts of the site that are no pages for users


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
    return [*of_sizes(), *of_core(), *of_names(), *of_commands(), *of_pages(), *of_tests(run=tests)]


def of_sizes() -> Iterator[Figure]:
    """Lines of Python, empty ones included."""
    sizes = {name: lines_of(files_at(str(folder.relative_to(ROOT)))) for name, folder in PACKAGES.items()}
    sizes |= {name: lines_of(files_at(name)) for name in ("tools", "tests")}
    yield Figure("wheel, cps_paper, tools and tests, lines", 108_896, 96_900, sum(sizes.values()))
    before = {
        "cps_envs": 24_994,
        "cps_baselines": 12_389,
        "cps_agents": 12_861,
        "cps_paper": 11_620,
        "tools": 11_527,
        "tests": 35_505,
    }
    for name, lines in sizes.items():
        yield Figure(f"  {name}", before[name], None, lines)


def of_core() -> Iterator[Figure]:
    """The rooms of the core, and circles of imports."""
    loose = [file for file in files_at("cps_envs/core/*.py") if file.stem != "__init__"]
    yield Figure("loose files in the core", 37, 3, len(loose))
    yield Figure("circles of imports, those inside functions too", 1, 0, len(circles(inside=True)))
    yield Figure("imports inside functions", 38, None, sum(map(inner_imports, shipped())))


def of_names() -> Iterator[Figure]:
    """Names that stand for more than one class, public names, and how far a knob spreads."""
    names = Counter(name for file in shipped() for name in classes_of(file) if not name.startswith("_"))
    yield Figure("class names used twice", 24, 25, sum(count > 1 for count in names.values()))
    public = sum(len(package.__all__) for package in (cps_envs, cps_baselines, cps_agents))
    yield Figure("public names of the three packages", None, None, public)
    code = [file for file in shipped() if file.name not in VALUES]
    for knob, before in KNOBS.items():
        yield Figure(
            f"shipped files that name the knob {knob}, values aside", before, 3, len(naming(rf"\b{knob}\b", code))
        )
    policies = sum(len(policy_names(problem, role)) for problem in cps_envs.PROBLEMS for role in ROLES)
    yield Figure("names of policies, by problem and role", None, None, policies)


def of_commands() -> Iterator[Figure]:
    """The command line."""
    yield Figure("commands", 17, 16, len(COMMANDS))
    yield Figure("parameters of commands", 252, None, sum(map(parameters, whole().commands.values())))


def parameters(command: object) -> int:
    """The options and arguments of a command and of those below it."""
    below = getattr(command, "commands", {}).values()
    return len(getattr(command, "params", ())) + sum(map(parameters, below))


def of_pages() -> Iterator[Figure]:
    """What users read: pages of the site that are neither evidence nor for developers."""
    parts = toctrees(ROOT / "docs" / "index.md")
    shown = [page for caption, pages in parts if caption not in BELOW for page in pages]
    below = {page for caption, pages in parts if caption in BELOW for each in pages for page in listed_below(each)}
    user = {page for each in shown for page in listed_below(each)} | {ROOT / "docs" / "index.md"}
    yield Figure(f"words of {len(user)} pages for users", 34_863, 35_000, sum(map(words_of, user)))
    yield Figure(f"words of {len(below)} other pages", 37_500, None, sum(map(words_of, below)))
    yield Figure("words of CHANGELOG.md", 4_683, 700, words_of(ROOT / "CHANGELOG.md"))


def of_tests(*, run: bool) -> Iterator[Figure]:
    """The CPU time of the quick tests."""
    yield Figure("make test-quick, CPU s (--tests measures it)", 60, 30, cpu_of_quick_tests() if run else None)


def cpu_of_quick_tests() -> int:
    """CPU seconds of `make test-quick`, user and system, with the processes that it starts."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(["make", "test-quick"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def cleared() -> Iterator[tuple[str, str]]:
    """Everything that was to go, each with "gone", who would miss it, or "still there"."""
    known = {name for problem in cps_envs.PROBLEMS for role in ROLES for name in policy_names(problem, role)}
    presets = cps_envs.find_problem("fdi").presets
    yield from ((each, "still there" if is_there(ROOT / each) else "gone") for each in MODULES)
    yield from ((f"policy {each}", "still there" if each in known else "gone") for each in POLICIES)
    yield from ((f"preset {each} of fdi", "still there" if each in presets else "gone") for each in FDI_PRESETS)
    yield from KEPT.items()


def is_there(path: Path) -> bool:
    """Whether a file is there, or anything in a folder but what Python left of it."""
    return path.is_file() or any(each.is_file() and "__pycache__" not in each.parts for each in path.rglob("*"))


def main() -> None:
    """Print the tables."""
    given = argparse.ArgumentParser(prog="python -m tools.census", description=__doc__)
    given.add_argument("--tests", action="store_true", help="run the quick tests and tell their CPU time")
    rows = [
        (each.what, *map(shown, (each.before, each.wanted, each.reached)), each.verdict)
        for each in figures(tests=given.parse_args().tests)
    ]
    out().print(Sheet("The house: before, wanted, reached", ("", "before", "wanted", "reached", ""), rows))
    out().print(Sheet("What was to go", ("", ""), list(cleared()), left=2))


def shown(number: int | None) -> str:
    """With separators of thousands; a dash where there is none."""
    return "-" if number is None else f"{number:,}"


if __name__ == "__main__":
    main()
