"""Cases of which some are tried at once and all in the slow run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def in_turn(cases: Iterable[Any], every: int) -> list[Any]:
    """`cases` for `parametrize`, in their order; the first of each `every` is quick, the others are marked slow."""
    return [case if place % every == 0 else slow(case) for place, case in enumerate(cases)]


def slow(case: Any) -> Any:
    """A case that only `make test-slow` tries; one that is a `pytest.param` keeps its name and marks."""
    if isinstance(case, type(pytest.param())):
        return pytest.param(*case.values, id=case.id, marks=(*case.marks, pytest.mark.slow))
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow)
