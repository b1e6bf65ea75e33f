"""What the files of the repository hold, counted from their syntax and text, for `tools.census`."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "cps_envs": ROOT / "cps_envs",
    "cps_baselines": ROOT / "baselines" / "cps_baselines",
    "cps_agents": ROOT / "agents" / "cps_agents",
    "cps_paper": ROOT / "paper" / "cps_paper",
}
Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda


def files_at(pattern: str) -> list[Path]:
    """The files that a pattern from the root names; of a folder its Python files.

    Raises:
        FileNotFoundError: it names nothing, so what it counted is gone or has moved.
    """
    found = sorted(ROOT.glob(pattern))
    if not found:
        raise FileNotFoundError(f"{pattern} names nothing: say where it has moved")
    return [file for place in found for file in (sorted(place.rglob("*.py")) if place.is_dir() else [place])]


def shipped() -> list[Path]:
    """The Python files of all packages."""
    return [file for folder in PACKAGES.values() for file in sorted(folder.rglob("*.py"))]


def lines_of(files: Sequence[Path]) -> int:
    """Lines, empty ones included."""
    return sum(text_of(file).count("\n") for file in files)


@cache
def text_of(file: Path) -> str:
    """Its text."""
    return file.read_text(encoding="utf-8")


class Node(NamedTuple):
    """A node of a file's syntax, and what it lies in."""

    node: ast.AST
    in_function: bool
    for_types: bool  # below `if TYPE_CHECKING`


@cache
def nodes_of(file: Path) -> list[Node]:
    """All nodes of its syntax."""
    found, left = [], [Node(ast.parse(text_of(file)), in_function=False, for_types=False)]
    while left:
        node, in_function, for_types = left.pop()
        found.append(Node(node, in_function, for_types))
        in_function = in_function or isinstance(node, Function)
        for_types = for_types or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
        left += [Node(child, in_function, for_types) for child in ast.iter_child_nodes(node)]
    return found


def classes_of(file: Path) -> list[str]:
    """The classes that a file defines, classes inside others included."""
    return [each.node.name for each in nodes_of(file) if isinstance(each.node, ast.ClassDef)]


def naming(pattern: str, files: Sequence[Path]) -> list[Path]:
    """Those of the files in which something is named."""
    known = re.compile(pattern)
    return [file for file in files if known.search(text_of(file))]


def inner_imports(file: Path) -> int:
    """Import statements inside functions."""
    return sum(each.in_function and isinstance(each.node, ast.Import | ast.ImportFrom) for each in nodes_of(file))


def circles(*, inside: bool) -> list[set[str]]:
    """Groups of modules that import each other when loaded; with `inside` also when functions run. Types make none."""
    modules = {module_of(file): file for file in shipped()}
    graph = {name: imported(file, set(modules), inside=inside) - {name} for name, file in modules.items()}
    reach = {name: reachable(graph, name) for name in graph}
    groups = {frozenset(other for other in reach[name] if name in reach[other]) for name in graph}
    return [set(group) for group in groups if len(group) > 1]


def module_of(file: Path) -> str:
    """Its name for `import`."""
    folder = next(folder for folder in PACKAGES.values() if file.is_relative_to(folder))
    return ".".join(file.relative_to(folder.parent).with_suffix("").parts).removesuffix(".__init__")


def imported(file: Path, modules: set[str], *, inside: bool) -> set[str]:
    """Which of these modules a file imports."""
    found = set()
    for node, in_function, for_types in nodes_of(file):
        if for_types or (in_function and not inside):
            continue
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            whole = {f"{node.module}.{each.name}" for each in node.names}
            found |= whole & modules or {node.module}
    return found & modules


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


def toctrees(page: Path) -> list[tuple[str, list[Path]]]:
    """The lists of pages that a page holds: caption, and pages."""
    lists = re.findall(r"```\{toctree\}\n(.*?)```", text_of(page), re.DOTALL)
    found = []
    for listed in lists:
        caption = re.search(r":caption: ([^\n]+)", listed)
        names = [line.strip() for line in listed.splitlines() if line.strip() and not line.startswith(":")]
        found.append((caption[1].strip() if caption else "", [_page(page.parent / name) for name in names]))
    return found


def _page(place: Path) -> Path:
    return next(file for end in (".md", ".ipynb") if (file := place.with_name(place.name + end)).is_file())


def listed_below(page: Path) -> list[Path]:
    """A page and every page that it lists, at any depth."""
    return [page, *(each for _, pages in toctrees(page) for below in pages for each in listed_below(below))]


def words_of(page: Path) -> int:
    """Words of a page without its code, with those of files that it includes; of a notebook those of its text."""
    text = text_of(page)
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    included = re.findall(r"```\{include\} (\S+)", text)
    text = re.sub(r"```.*?```|<!--.*?-->", "", text, flags=re.DOTALL)
    return len(re.findall(r"\w[\w'.,-]*", text)) + sum(words_of((page.parent / each).resolve()) for each in included)
