"""No kernel reads or writes outside its arrays: every problem is played once with numba's checks of indices."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from math import gcd
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.conformance.actors import Actor
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.types import ROLES, Array, BoolArray, FloatArray, Role
from cps_paper.testbed.robots.problem import TESTBED
from tests.settings import tests_of as settings_of

ROOT = Path(__file__).parents[3]
NUM_ENVS = 3
PLAYED: Mapping[str, Problem] = {**PROBLEMS, TESTBED.name: TESTBED}
SETTINGS: Mapping[str, tuple[Mapping[str, Any], ...]] = {  # beside the short episode of every preset
    "hvac": ({"attacker_view": "grey", "attack_action": "bias", "num_sensors": 8}, {"onset_step": 0, "set_size": 3}),
}


@kernel
def beyond(values: FloatArray, place: int) -> float:
    return float(values[place])


@pytest.mark.slow
@pytest.mark.parametrize("name", PLAYED)
def test_kernels_stay_inside_their_arrays(name: str, tmp_path: Path) -> None:
    surroundings = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    code = f"from tests.core.compute.test_bounds import play_all; play_all({name!r})"
    played = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=surroundings, capture_output=True, text=True)
    assert played.returncode == 0, played.stderr[-3000:]
    assert "episodes ended" in played.stdout


def play_all(name: str) -> None:
    """Play short episodes of each preset of a problem to their end, with random legal actions of both roles."""
    with pytest.raises(IndexError):
        beyond(np.zeros(3), 3)  # else numba checks nothing
    problem, short = PLAYED[name], settings_of(name).short
    for preset in problem.presets:
        for more in ({}, *SETTINGS.get(name, ())):
            play(problem.game(problem.config(preset, {**short, **more}), NUM_ENVS))
    print("all episodes ended")


def play(game: Game) -> None:
    """Two episodes per environment, the second ones started and moved at different times."""
    actors = {
        role: [Actor(game.action_space[role], game.neutral_action[role], [b, place]) for b in range(NUM_ENVS)]
        for place, role in enumerate(ROLES)
    }
    generators = [np.random.default_rng(b) for b in range(NUM_ENVS)]
    stride = gcd(*(game.decision_interval[role] for role in ROLES))
    every = np.ones(NUM_ENVS, np.bool_)
    held: dict[Role, Array] = {}
    game.reset(every, generators)
    for first in range(NUM_ENVS):
        while (envs := (game.elapsed < game.horizon) & ~game.terminated).any():
            envs[first] &= game.elapsed[first] % (2 * stride) == 0 or envs.sum() == 1
            for role in ROLES:
                masks = game.action_mask(role)
                drawn = [actor.act(None if masks is None else masks[b]) for b, actor in enumerate(actors[role])]
                due = game.elapsed % game.decision_interval[role] == 0
                held[role] = np.where(_like(due, drawn), np.array(drawn), held.get(role, np.array(drawn)))
            game.advance(held, envs, min(stride, game.horizon - int(game.elapsed[envs].max())))
            seen = [*(game.observe(role) for role in ROLES), *game.metrics().values()]
            assert all(len(values) == NUM_ENVS for values in seen)
        again = np.arange(NUM_ENVS) >= first
        game.reset(again, generators)


def _like(marked: BoolArray, values: Any) -> BoolArray:
    """Marks (B,) with the axes of values (B, ...)."""
    return marked.reshape(-1, *[1] * (np.ndim(values) - 1))
