"""The scale of learners' inputs in preset `learning`, which ships: `python -m tools.scaling` measures and writes it.

`--check` measures nothing and fails if a file is of other settings than those of now.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from cps_envs import PROBLEMS
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.learning.scaling import measure, scaling_key, shipped
from cps_envs.core.learning.setting import setting
from cps_envs.core.learning.wiring import Wiring
from cps_envs.core.types import ROLES


def wirings(problem: Problem) -> Iterator[Wiring]:
    """How the roles are seen by default, and as a team."""
    for role in ROLES:
        found = setting(problem, role, LEARNING, LEARNING, {})
        training = found.training
        for adapter in dict.fromkeys((training.adapter, problem.swarm.get(role, training.adapter))):
            seen = replace(training, adapter=adapter)
            yield Wiring(problem.name, role, adapter, seen.frame_skip, seen.recent_s, seen.rough_s)


def statistics(problem: Problem) -> dict[str, dict[str, Any]]:
    """By key: whose inputs they are, their mean and their deviation."""
    config = problem.config(LEARNING, {})
    found: dict[str, dict[str, Any]] = {}
    for wiring in wirings(problem):
        mean, deviation = measure(problem, config, LEARNING, wiring)
        facts = {"role": wiring.role, "adapter": wiring.adapter, "mean": mean, "deviation": deviation}
        found[scaling_key(problem, config, wiring)] = facts
        print(f"{problem.name}, {wiring.role}, {wiring.adapter}: {len(mean)} inputs", flush=True)
    return found


def stale(problem: Problem) -> list[str]:
    """The interfaces of a problem whose scale does not ship."""
    config = problem.config(LEARNING, {})
    kept = shipped(problem.scaling) if problem.scaling else {}
    return [
        f"{problem.name}, {wiring.role}, {wiring.adapter}"
        for wiring in wirings(problem)
        if scaling_key(problem, config, wiring) not in kept
    ]


def as_text(found: dict[str, dict[str, Any]]) -> str:
    """JSON with a line for each list."""
    entries = []
    for key, facts in found.items():
        lines = ",\n".join(f'    "{name}": {json.dumps(value)}' for name, value in facts.items())
        entries.append(f'  "{key}": {{\n{lines}\n  }}')
    return "{\n" + ",\n".join(entries) + "\n}\n"


def main(arguments: list[str] | None = None) -> int:
    """Write the files, or check them."""
    parser = argparse.ArgumentParser(prog="python -m tools.scaling", description=__doc__)
    parser.add_argument("problem", nargs="*", metavar="PROBLEM", help=f"default: {' '.join(PROBLEMS)}")
    parser.add_argument("--check", action="store_true", help="only say what does not ship")
    options = parser.parse_args(arguments)
    problems = [PROBLEMS[name] for name in options.problem or PROBLEMS]
    if options.check:
        missing = [each for problem in problems for each in stale(problem)]
        print("\n".join(missing) or "the scale of every interface ships")
        return int(bool(missing))
    for problem in problems:
        assert problem.scaling is not None
        problem.scaling.write_text(as_text(statistics(problem)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
