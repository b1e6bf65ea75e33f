"""How the inputs of learners are scaled: by what random play meets, once for a configuration and an interface.

The statistics of the presets for learning ship with the problems, as `scaling.json` beside their code. So a single
environment has the same inputs as a batch, and every process has the same. For another configuration they are measured
when they are first needed, always in the same way.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from cps_envs.core.compute.compiling import tell
from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.declare.objective import is_objective
from cps_envs.core.declare.seeds import MOST_RUNS, training_seed
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.problem import Problem
from cps_envs.core.learning.side import LearningSide
from cps_envs.core.learning.wiring import LEAST_DEVIATION, Scaling, Wiring
from cps_envs.core.types import Array, BoolArray, Observation, other

EPISODES = 64  # of a measurement
MOST_SAMPLES = 50_000  # rows of which mean and deviation are taken
DIGITS = 5  # significant ones of a statistic
SEED = training_seed(MOST_RUNS - 1)  # of the first episode: the last run that training may have

_measured: dict[str, Scaling] = {}


def scaling_for(problem: Problem, config: Any, preset: str, wiring: Wiring) -> Scaling:
    """Mean and deviation of an agent's inputs under a wiring: those that ship, or measured once in this process.

    Raises:
        ConfigurationError: no agent was ever active, so there is nothing to learn.
    """
    key = scaling_key(problem, config, wiring)
    kept = shipped(problem.scaling).get(key) if problem.scaling else None
    if kept is not None:
        return tuple(kept["mean"]), tuple(kept["deviation"])
    if key not in _measured:
        name = f"{problem.name.capitalize()}, {wiring.role}"
        tell(f"cps_envs: measuring the scale of inputs once ({name}: not the shipped settings)")
        _measured[key] = measure(problem, config, preset, wiring)
    return _measured[key]


def scaling_key(problem: Problem, config: Any, wiring: Wiring) -> str:
    """A digest of what statistics depend on: problem, changed fields of its configuration, what agents see and when.

    What is paid changes nothing of it.
    """
    seen = (wiring.role, wiring.adapter, wiring.frame_skip, wiring.recent_s, wiring.rough_s)
    changed = [
        (field.name, value)
        for field in dataclasses.fields(config)
        if not is_objective(field) and (value := getattr(config, field.name)) != field.default
    ]
    return hashlib.sha256(repr((problem.name, problem.version, changed, seen)).encode()).hexdigest()[:16]


@cache
def shipped(path: Path) -> dict[str, Any]:
    """The statistics in a file, by `scaling_key`; none if it is not there."""
    return dict(json.loads(path.read_text())) if path.is_file() else {}


def measure(problem: Problem, config: Any, preset: str, wiring: Wiring) -> Scaling:
    """Play `EPISODES` episodes at random, begun at different times, and take statistics of what active agents see.

    Raises:
        ConfigurationError: no agent was ever active.
    """
    rival = other(wiring.role)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ForeignSettingWarning)  # the usual opponent is to show what inputs are like
        match = problem.match(config, EPISODES, {rival: problem.opponent(preset, rival)})
    side = LearningSide(match, wiring.role, wiring)
    met = [rows[active] for rows, active in random_play(match, side)]
    scaled = np.concatenate(met)[:, : side.wired.columns.scaled]
    if len(scaled) == 0:
        raise ConfigurationError(
            "no agent was active in a first pass, so there is nothing to learn: name another opponent or adapter, "
            "or make episodes longer"
        )
    scaled = scaled[:: len(scaled) // MOST_SAMPLES + 1].astype(np.float64)
    spread = np.maximum(scaled.std(axis=0), LEAST_DEVIATION)
    return _rounded(scaled.mean(axis=0)), _rounded(spread)


def random_play(match: Any, side: LearningSide) -> Iterator[tuple[Observation, BoolArray]]:
    """What the agents see, (B x A, n), and which are active, decision by decision; each episode restarts once."""
    game = match.game
    generators, draws = seeded([SEED + b for b in range(game.num_envs)]), np.random.default_rng(SEED)
    everyone = np.ones(game.num_envs, np.bool_)
    decisions = -(-game.horizon // (game.decision_interval[side.wired.wiring.role] * side.frame_skip))
    begins = draws.integers(0, decisions, game.num_envs)
    again = everyone
    for decision in range(decisions):
        if again.any():
            match.reset(again, generators)
            side.begin(again)
        yield side.player.rows().reshape(-1, side.wired.columns.size), side.player.active().reshape(-1)
        side.step(random_actions(side, draws), everyone, game.horizon)
        again = game.terminated | (game.elapsed >= game.horizon) | (begins == decision)


def random_actions(side: LearningSide, generator: np.random.Generator) -> Array:
    """Uniform draws from the legal actions of the rows, (B x rows, ...)."""
    count, choices = side.rows * len(side.player.state[0]), choices_of(side.action_space)
    if not choices:
        return generator.uniform(-1.0, 1.0, (count, *(side.action_space.shape or ())))
    chances, masks = generator.random((count, sum(choices))), side.masks()
    if masks is not None:
        chances = np.where(masks, chances, -1.0)
    parts = np.split(chances, np.cumsum(choices)[:-1], axis=1)
    drawn = np.stack([part.argmax(axis=1) for part in parts], axis=1)
    return drawn.reshape(count, *(side.action_space.shape or ()))


def _rounded(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.{DIGITS}g}") for value in values)
