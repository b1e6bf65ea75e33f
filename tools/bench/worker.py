"""One side of `tools.bench.against`: measures rows of whatever checkout is on the path, as it is asked to on stdin."""

from __future__ import annotations

import importlib.util
import json
import sys
import types
from collections.abc import Iterable
from math import inf
from typing import Any

import numpy as np

# Yardsticks of a side: the other side is what a row is compared with.
NO_LIMITS = types.SimpleNamespace(updates_per_s=inf, divisions_per_s=inf)


def know_old_names() -> None:
    """Give commit f6bcd2d6 the names that the measures use."""
    if importlib.util.find_spec("cps_envs.core.compute.generators") is None:
        from cps_agents.bench import row

        module: Any = types.ModuleType("cps_envs.core.compute.generators")
        module.seeded = lambda seeds: [np.random.default_rng(seed) for seed in seeds]
        sys.modules[module.__name__] = module
        old: Any = row
        old.Measurement = old.Item


def work(questions: Iterable[str]) -> None:
    """Answer lines of JSON: without a name what rows there are, else the values of a row, or null where it fails."""
    from cps_envs import PROBLEMS, find_problem
    from tools.bench import resets, sizes, threads

    problems = [find_problem(name) for name in PROBLEMS]
    rows = {(row.part, row.name): row for part in (sizes, resets, threads) for row in part.items(problems)}
    for line in questions:
        question = json.loads(line)
        answer: Any = list(rows)
        if question:
            answer = values(rows[question["part"], question["name"]], question["seconds"])
        print(json.dumps(answer), flush=True)


def values(row: Any, seconds: float) -> Any:
    """The values of a row, None where this checkout refuses its configuration; shares of limits are not looked at."""
    from cps_envs.core.errors import ConfigurationError

    try:
        return row.measure(seconds, NO_LIMITS)
    except ConfigurationError:
        return None


if __name__ == "__main__":
    know_old_names()
    work(sys.stdin)
