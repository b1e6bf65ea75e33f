"""Code that judges and trains is the same for every problem: none of it names one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import cps_agents
from cps_envs import PROBLEMS

ROOT = Path(cps_agents.__path__[0])
OF_A_PROBLEM = ("recipes/learning.py", "commands/certify.py")  # its networks' knobs, and the command of false data
PACKAGE = re.compile(rf"(?:cps_envs|cps_baselines)\.(?:{'|'.join(PROBLEMS)})\b")


def names_in(path: Path) -> Iterator[str]:
    """The problems that code names: as a whole text, or by importing from one's package."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and node.value in PROBLEMS:
            yield str(node.value)
        modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        modules += [each.name for each in node.names] if isinstance(node, ast.Import) else []
        yield from (module for module in modules if PACKAGE.match(module))


def test_no_general_module_names_a_problem() -> None:
    named = {path.relative_to(ROOT).as_posix(): list(names_in(path)) for path in ROOT.rglob("*.py")}
    assert {name: found for name, found in named.items() if found and name not in OF_A_PROBLEM} == {}
    assert all(named[name] for name in OF_A_PROBLEM)
