"""The generated pages of docs/: `python -m cps_agents.docs` writes them, `--check` tells whether they are current."""

from __future__ import annotations

import argparse
import difflib
import inspect
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from cps_agents import chapters
from cps_agents.catalogue import PolicyEntry, pettingzoo_ids, policies
from cps_agents.files import write_text
from cps_envs import PROBLEMS
from cps_envs.core.problem import Problem
from cps_envs.core.registration import class_name
from cps_envs.core.types import ROLES, Role

FOLDER = Path(__file__).parents[2] / "docs"
HEAD = """# Environments

<!-- Written by `make docs` from the docstrings of the environments and the policies; do not edit. -->
"""


def pages() -> dict[str, str]:
    """The text of each page by its file name."""
    return {"environments.md": environments(), "chapters.md": chapters.render()}


def environments() -> str:
    """The page of all environments."""
    parts = [part for problem in PROBLEMS.values() for part in chapter(problem)]
    return "\n".join([HEAD, *_contents(), *parts]).rstrip() + "\n"


def _contents() -> Iterator[str]:
    yield "| Id | For | Problem |\n|---|---|---|"
    for problem in PROBLEMS.values():
        for role in ROLES:
            yield f"| [`{problem.env_id(role)}`](#{_anchor(problem, role)}) | {role} | {problem.summary} |"
    yield ""


def _anchor(problem: Problem, role: Role) -> str:
    return class_name(problem, role).lower()


def chapter(problem: Problem) -> Iterator[str]:
    """The parts of a problem's page: environments, forms, presets, policies."""
    for role in ROLES:
        name = class_name(problem, role)
        yield f"## {name}\n\n```python\n{_snippet(problem, role)}\n```\n"
        made: Any = load_env_creator(str(gymnasium.spec(problem.env_id(role)).entry_point))
        yield _deeper(inspect.getdoc(made) or "") + "\n"
    yield f"## {problem.name}: both roles, and teams\n"
    for form, function in pettingzoo_ids(problem).items():
        if form != "id":
            yield f"### `{function}`\n\n{_docstring(function)}\n"
    yield from _teams(problem)
    yield f"## {problem.name}: presets\n\n{_presets(problem)}\n"
    for role in ROLES:
        yield f"## {problem.name}: policies of the {role}\n\n{_policies(policies(problem, role))}\n"


def _snippet(problem: Problem, role: Role) -> str:
    made = f'"{problem.namespace}:{problem.env_id(role)}"'
    return (
        f"env = gymnasium.make({made})\n"
        f'envs = gymnasium.make_vec({made}, num_envs=64, vectorization_mode="vector_entry_point")'
    )


def _deeper(text: str) -> str:
    """Headings one level lower."""
    return "\n".join(f"#{line}" if line.startswith("#") else line for line in text.splitlines())


def _docstring(path: str) -> str:
    module, _, function = path.rpartition(".")
    return inspect.getdoc(getattr(import_module(module), function)) or ""


def _teams(problem: Problem) -> Iterator[str]:
    """What the agents of decentralised roles observe."""
    game = problem.game(problem.presets["paper"], 1)
    for role in ROLES:
        try:
            team = game.team(role)
        except TypeError:
            continue
        yield f"### The {role} as a team\n"
        first, last = team.agents[0], team.agents[-1]
        yield f"{len(team.agents)} agents, `{first}` to `{last}`; each acts in `{team.action_space}`.\n"
        yield f"{team.fields.table()}\n"


def _presets(problem: Problem) -> str:
    """How each preset differs from `paper`."""
    paper = vars(problem.presets["paper"])
    lines = ["| Preset | Attacker by default | Defender by default | Differs from `paper` in |", "|---|---|---|---|"]
    for name, config in problem.presets.items():
        changed = [f"`{field} = {value!r}`" for field, value in vars(config).items() if value != paper[field]]
        players = problem.opponents[name]
        differences = ", ".join(changed) or "-"
        lines.append(f"| `{name}` | `{players['attacker']}` | `{players['defender']}` | {differences} |")
    return "\n".join(lines)


def _policies(entries: list[PolicyEntry]) -> str:
    lines = ["| Name | What it does | Knows beyond what it observes |", "|---|---|---|"]
    for entry in entries:
        summary = entry.summary or f"needs {entry.missing}"
        lines.append(f"| `{entry.name}` | {summary} | {', '.join(entry.privileged) or '-'} |")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Write the pages, or compare them; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m cps_agents.docs", description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing; exit code 1 if a page is out of date")
    options: Any = parser.parse_args(arguments)
    if options.check:
        old = [name for name, page in pages().items() if _is_old(FOLDER / name, page)]
        return int(bool(old))
    for name, page in pages().items():
        write_text(FOLDER / name, page)
    return 0


def _is_old(path: Path, page: str) -> bool:
    """Whether a file is another one than this page, and a few lines on stderr that say in what."""
    written = path.read_text(encoding="utf-8") if path.exists() else ""
    if page == written:
        return False
    difference = difflib.unified_diff(written.splitlines(), page.splitlines(), "written", "current", n=0)
    print("\n".join(list(difference)[:20]), file=sys.stderr)
    print(f"docs/{path.name} is out of date: run `make docs`.", file=sys.stderr)
    return True


if __name__ == "__main__":
    sys.exit(main())
