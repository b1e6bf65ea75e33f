"""Configurations with a few fields set to anything, and opponents asked for by strings of every kind."""

from __future__ import annotations

import dataclasses
import inspect
import math
import warnings
from importlib.metadata import entry_points
from typing import Any

import numpy as np

from cps_envs import PROBLEMS, find_problem
from cps_envs.core.conformance.actors import Crew
from cps_envs.core.declare.config import is_whole
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.policies.lookup import GROUP, policy_names
from cps_envs.core.types import ROLES, Role
from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.judging import Tally, limited, wrong_numbers
from tools.reliability.fuzz.values import Generator, in_words, number_within, odd_value, pick, shown

CONFIGURATIONS, OPPONENTS = 800, 300  # inputs of a chunk
STEPS = 3
PRESETS = ("learning", "paper")
QUICKER: dict[str, dict[str, Any]] = {"hvac": {"prediction_steps": 10}}  # its gains take a second at 80 steps
STRANGE = (
    "zoo:",
    "zoo:nothing",
    "zoo:hvac-attack",
    "zoo:hvac-attack?seed=99",
    "sb3:model.zip",
    "os:system",
    "builtins:print",
    "a:b:c",
    ":",
    "?",
    "none?x=1",
    "mixture",
    "always",
    "always?action=0",
    "always?action=[[0]]",
    'mixture?policies=["none","none"]',
    'mixture?policies=["none"]&weights=[-1]',
    "mixture?policies=" + "[" * 3000,
)


def seat(number: int) -> tuple[Problem, Role, str]:
    """Problem, role and preset of a chunk."""
    names = sorted(PROBLEMS)
    problem, role = find_problem(names[number % len(names)]), ROLES[number // len(names) % 2]
    return problem, role, PRESETS[number // (2 * len(names)) % 2]


def configurations(chunk: Chunk, tally: Tally) -> None:
    """Up to three fields are changed; what is accepted is played by both roles for some steps."""
    problem, _, preset = seat(chunk.number)
    rng = np.random.default_rng([chunk.number, 3])
    fields = dataclasses.fields(problem.config("paper", {}))
    warnings.simplefilter("ignore")

    def play(changes: dict[str, Any]) -> str | None:
        env = RolesParallelEnv(
            problem, preset=preset, interface="native", **{**QUICKER.get(problem.name, {}), **changes}
        )
        crew = Crew(env, 1)
        observations, infos = env.reset(seed=1)
        rewards = dict.fromkeys(observations, 0.0)
        for _ in range(STEPS):
            for agent, seen in observations.items():
                parts = [rewards[agent], *(value for value in infos[agent].values() if isinstance(value, float))]
                if wrong := wrong_numbers(seen, parts):
                    return wrong
            if not env.agents:
                break
            observations, rewards, _, _, infos = env.step(crew.act(infos))
        return None

    for _ in range(CONFIGURATIONS):
        count = int(rng.integers(1, 4))
        chosen = [fields[place] for place in rng.choice(len(fields), count, replace=False)]
        changes = {field.name: _value(field, rng) for field in chosen}
        what = f"{problem.name} {preset} {shown(changes)}"
        tally.attempt(what, limited(lambda changes=changes: play(changes)))  # type: ignore[misc]


def _value(field: dataclasses.Field[Any], rng: Generator) -> Any:
    """Something that a field may be set to, in or out of its bounds, or anything."""
    rule, kind = field.metadata, rng.random()
    if kind < 0.25:
        return odd_value(rng)[1]
    if rule["choices"]:
        words = list(rule["choices"])
        return pick(words, rng) if kind < 0.8 else tuple(words[: rng.integers(len(words) + 1)])
    if isinstance(field.default, (bool, str)):
        return odd_value(rng)[1]
    low, high, whole = rule["low"], rule["high"], is_whole(field)
    one, other = (number_within(low, high, rng, whole) for _ in range(2))
    if kind < 0.35 and math.isfinite(low):
        return low - (1 if whole else 1e-6)
    return one if kind < 0.8 else (one, other) if kind < 0.9 else [one, other]


def opponents(chunk: Chunk, tally: Tally) -> None:
    """Names, options and sources; what is found plays a few steps."""
    problem, role, preset = seat(chunk.number)
    rng = np.random.default_rng([chunk.number, 4])
    rival = ROLES[1 - ROLES.index(role)]
    overrides = QUICKER.get(problem.name, {})
    warnings.simplefilter("ignore")

    def play(reference: str) -> str | None:
        game = problem.match(problem.config(preset, overrides), 1, {rival: reference})
        envs = np.ones(1, np.bool_)
        game.reset(envs, [np.random.default_rng(0)])
        neutral = game.game.neutral_action[role][np.newaxis]
        paid = game.step({role: neutral}, envs, game.game.decision_interval[role])
        return wrong_numbers(game.game.observe(role), paid)

    for _ in range(OPPONENTS):
        reference = _reference(problem.name, rival, rng)
        what = f"{problem.name} {preset} {rival} {reference[:120]!a}"
        tally.attempt(what, limited(lambda reference=reference: play(reference)))  # type: ignore[misc]


def _reference(problem: str, role: Any, rng: Generator) -> str:
    """A name of this role, of another one or of none, with options that are known, unknown or malformed."""
    kind = rng.random()
    if kind < 0.15:
        return pick(STRANGE, rng)
    if kind < 0.25:
        return in_words(odd_value(rng)[1])
    if kind < 0.4:
        names = [entry.name for entry in entry_points(group=GROUP)]
        name = pick(names, rng)
    else:
        names = policy_names(problem, role)
        name = pick(names, rng)
    options = [_option(problem, role, name, rng) for _ in range(rng.integers(0, 3))]
    return name + ("?" + "&".join(options) if options else "")


def _option(problem: str, role: Any, name: str, rng: Generator) -> str:
    known = [each for each in _parameters(f"{problem}.{role}.{name}") if each not in ("self", "spec")]
    option = pick(known, rng) if known and rng.random() < 0.8 else "unknown"
    value = odd_value(rng)[1]
    if rng.random() < 0.5:
        value = [0, 1, -1, 0.5, 100, "true", "[]", "[[1,2]]", "[0.1]", '{"a":1}', "null"][rng.integers(11)]
    return f"{option}={in_words(value)}" if rng.random() < 0.95 else option


def _parameters(full: str) -> list[str]:
    found = [entry for entry in entry_points(group=GROUP) if entry.name == full]
    return list(inspect.signature(found[0].load()).parameters) if found else []
