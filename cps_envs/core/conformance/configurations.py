"""Every configuration that is accepted can be played, at the ends of each field's bounds too."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.subject import Subject
from cps_envs.core.declare.config import bounds, is_list, is_whole
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError

PAIRS = 60  # of edges that are tried together, unless told otherwise
STEPS = 12  # game steps of each, or the end of the episode
HALVINGS = 40

Change = dict[str, Any]


def check_configurations(subject: Subject, *, pairs: int = PAIRS, steps: int = STEPS) -> None:
    """Whatever value each field is given, the configuration is refused with its remedy, or it can be played.

    Each field goes to both ends of its bounds, to each of its choices, and, where the other fields refuse an end, as
    far as they allow. Some pairs of such changes follow, drawn but the same in every run. What is accepted is played by
    both roles with random legal actions for `steps` game steps: observations lie in their spaces, and rewards and
    metrics are finite.
    """
    base = subject.parallel().game.config
    found = list(edges(base))
    for change in (*found, *_drawn_pairs(found, pairs)):
        if _accepted(base, change):
            _play(subject, change, steps)


def edges(base: Any) -> Iterator[Change]:
    """One field of a configuration changed at a time: to the ends of what is allowed, and to each other choice."""
    for field in dataclasses.fields(base):
        own = getattr(base, field.name)
        for value in _extremes(field, own):
            yield {field.name: value}
            if _is_number(value) and _has_ends(own) and not _accepted(base, {field.name: value}):
                yield from ({field.name: last} for last in _limit(base, field, value))


def _extremes(field: dataclasses.Field[Any], own: Any) -> Iterator[Any]:
    """The values of a field to be tried, other than its own."""
    rule = field.metadata
    if rule["choices"]:
        single = [(word,) for word in rule["choices"]] if is_list(field) else list(rule["choices"])
        tried: list[Any] = [*single, (), tuple(rule["choices"])] if is_list(field) else single
    elif isinstance(field.default, bool):
        tried = [False, True]
    elif isinstance(field.default, str):
        tried = []
    else:
        kind = int if is_whole(field) else float
        ends = [kind(end) for end in (rule["low"], rule["high"]) if math.isfinite(end)]
        tried = [(end,) * max(len(own), 1) for end in ends] if is_list(field) else ends
        tried += [()] if is_list(field) else [tuple(ends)] if rule["ranged"] and len(ends) == 2 else []
        tried += [Series([own, own], 3600.0, repeats=True)] if rule["series"] and _is_number(own) else []
    return (value for value in tried if value != own)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _has_ends(own: Any) -> bool:
    return _is_number(own) or (isinstance(own, tuple) and len(own) == 2)


def _limit(base: Any, field: dataclasses.Field[Any], refused: float) -> Iterator[float]:
    """The last accepted value between a field's own and a refused one, if there is any beyond its own."""
    ends = bounds(getattr(base, field.name))
    accepted = start = min(ends, key=lambda end: abs(end - refused))
    if not _accepted(base, {field.name: start}):
        return
    for _ in range(HALVINGS):
        middle = (accepted + refused) / 2 if not is_whole(field) else (accepted + refused) // 2
        if middle in (accepted, refused):
            break
        if _accepted(base, {field.name: middle}):
            accepted = middle
        else:
            refused = middle
    if accepted != start:
        yield accepted


def _drawn_pairs(found: list[Change], number: int) -> Iterator[Change]:
    both = [{**one, **two} for one, two in combinations(found, 2) if one.keys() != two.keys()]
    for i in np.random.default_rng(0).permutation(len(both))[:number].tolist():
        yield both[i]


def _accepted(base: Any, change: Mapping[str, Any]) -> bool:
    """Whether a configuration can be made.

    Raises:
        AssertionError: making it fails in another way than by the refusal that users are told of.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # an overflow on the way to a refusal
            dataclasses.replace(base, **change)
    except ConfigurationError:
        return False
    except Exception as error:
        raise AssertionError(f"{change} is refused by {error!r} instead of a ConfigurationError") from error
    return True


def _play(subject: Subject, change: Change, steps: int) -> None:
    try:
        try:
            env = subject.parallel(**change)
        except ConfigurationError:
            return  # refused when the game is made: it needs what only the game knows
        crew = Crew(env, 95)
        observations, infos = env.reset(seed=95)
        _look(env, observations, {}, infos, f"{change} is accepted, but after reset")
        for step in range(1, steps + 1):
            observations, rewards, _, _, infos = env.step(crew.act(infos))
            _look(env, observations, rewards, infos, f"{change} is accepted, but after step {step}")
            if not env.agents:
                return
    except AssertionError:
        raise
    except Exception as error:
        raise AssertionError(f"{change} is accepted, but cannot be played: {error!r}") from error


def _look(env: Any, observations: Any, rewards: Any, infos: Any, where: str) -> None:
    for agent, observation in observations.items():
        assert np.isfinite(observation).all(), f"{where} the observation of {agent} is not finite"
        assert env.observation_space(agent).contains(observation), f"{where} {agent} observes what is not in its space"
        values = {"its reward": rewards.get(agent, 0.0), **infos[agent]}
        wrong = {name: value for name, value in values.items() if isinstance(value, float) and not math.isfinite(value)}
        assert not wrong, f"{where} {agent} gets {wrong}"
