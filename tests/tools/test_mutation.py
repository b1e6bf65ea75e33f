"""`python -m tools.mutation`: what it changes, and what it runs."""

from __future__ import annotations

import shlex
from typing import Any

from tools.mutation import MODULES, ROOT, mutants, spread


def test_a_mutant_differs_in_one_place() -> None:
    source = "def f(a: int = 3) -> bool:\n    return a < 2 and not a == 1\n"
    found = mutants(source, "f.py")
    changes = {what.partition(": ")[2] for what, _ in found}
    assert {"3  ->  4", "a < 2  ->  a <= 2", "not a == 1  ->  not not a == 1"} <= changes
    values = []
    for what, code in found:
        scope: dict[str, Any] = {}
        exec(code, scope)
        values.append((what, [scope["f"](a) for a in (0, 1, 2)] + [scope["f"]()]))
    assert [True, False, False, False] not in [results for what, results in values if "3  ->" not in what]


def test_modules_and_their_tests_exist() -> None:
    for module, tests in MODULES.items():
        assert (ROOT / module).is_file(), module
        for word in shlex.split(tests.partition(" -k ")[0]):
            assert all((ROOT / file).is_file() for file in spread(word)), word
