"""Running a module's tests with a mutant in its place, in a fork: nothing is imported twice, and no file changes."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.util
import os
import resource
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import CodeType, ModuleType

HEAVY = (  # imported once; none of them is ours
    "pytest",
    "hypothesis",
    "numpy",
    "numba",
    "gymnasium",
    "pettingzoo",
    "scipy.optimize",
    "scipy.stats",
    "safetensors.numpy",
    "typer.testing",
    "rich.console",
)
PYTEST = ("-x", "-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:cov", "--hypothesis-seed=0")


class Replacing(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives a module other code than its file has."""

    def __init__(self, module: str, path: Path, code: CodeType) -> None:
        self._module, self._path, self._code = module, path, code

    def find_spec(self, fullname: str, path: object = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Ours for the module, nothing for any other."""
        if fullname != self._module:
            return None
        return importlib.util.spec_from_file_location(fullname, self._path, loader=self)

    def exec_module(self, module: ModuleType) -> None:
        """Run the other code."""
        exec(self._code, module.__dict__)


def warm_up() -> None:
    """Import what every trial needs and no mutant is in."""
    for name in HEAVY:
        importlib.import_module(name)


def run_tests(root: Path, tests: Sequence[str], limit_s: int, mutant: Replacing | None = None) -> tuple[int, float]:
    """Exit code of pytest (negative: ended by that signal) in a fork, and the CPU seconds that it took."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            code = _tests_of_fork(root, tests, limit_s, mutant)
        finally:
            os._exit(code)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime


def _tests_of_fork(root: Path, tests: Sequence[str], limit_s: int, mutant: Replacing | None) -> int:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 1))
    os.chdir(root)
    if mutant is not None:
        sys.meta_path.insert(0, mutant)
    import pytest

    return int(pytest.main([*PYTEST, *tests]))
