"""What a seeded reset costs, for each environment of a large batch."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium

from cps_agents.bench.row import Measurement, Values, Yardsticks, calls_per_s
from cps_envs.core.game.problem import Problem

PART = "resets"
NUM_ENVS = 1024
PRESETS = ("paper", "learning")


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The attacker's vector form of each problem against `none`."""
    for problem in problems:
        for preset in PRESETS:
            yield Measurement(PART, f"{problem.name} {preset}", partial(_measure, problem.env_id("attacker"), preset))


def _measure(env_id: str, preset: str, seconds: float, yardsticks: Yardsticks) -> Values:
    """Microseconds with new seeds, and where every environment goes on with its own random numbers."""
    envs: Any = gymnasium.make_vec(env_id, NUM_ENVS, "vector_entry_point", preset=preset, opponent="none")
    seeded, going_on = (
        1e6 / NUM_ENVS / calls_per_s(reset, seconds / 2) for reset in (lambda: envs.reset(seed=0), envs.reset)
    )
    return {"reset_us": seeded, "again_us": going_on}
