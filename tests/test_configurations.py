"""Configurations: every field refuses what it cannot take, by name, and what is accepted can be played."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs import PROBLEMS
from cps_envs.core.conformance import Subject, check_configurations
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.problem import Problem
from cps_paper.testbed.robots.problem import TESTBED
from tests.test_conformance import subject_of

EVERY = (*PROBLEMS.values(), TESTBED)
FIELDS = [(problem, field) for problem in EVERY for field in dataclasses.fields(problem.config("paper", {}))]
SWITCHES = [(problem, field) for problem, field in FIELDS if isinstance(field.default, bool)]
CHOICES = [(problem, field) for problem, field in FIELDS if field.metadata["choices"]]
NUMBERS = [  # and tuples of numbers
    (problem, field)
    for problem, field in FIELDS
    if not field.metadata["choices"] and not isinstance(field.default, (bool, str))
]
RANGES = [(problem, field) for problem, field in NUMBERS if field.metadata["ranged"]]
Field = dataclasses.Field[Any]
QUICK = ("paper", "learning")
PAIRS, STEPS, SLOW_PAIRS, SLOW_STEPS = 3, 4, 1000, 100

QUICKER: Mapping[str, Any] = {"hvac": {"prediction_steps": 10}}  # its gains take a second at 80 steps


def many(field: Field) -> bool:
    """Whether it takes any number of numbers."""
    return isinstance(field.default, tuple) and not field.metadata["ranged"]


def junk(field: Field) -> st.SearchStrategy[Any]:
    values: list[Any] = [None, "fast", math.nan, math.inf, -math.inf, True, {}, [math.nan, 1.0], (math.nan,), ("a",)]
    more: list[Any] = [[[1, 2]]] if many(field) else [(1, 2, 3), (2.0, 1.0)]
    return st.sampled_from([*values, *more]) | st.text(min_size=1, max_size=5)


def named(pairs: list[tuple[Problem, Field]]) -> pytest.MarkDecorator:
    names = [f"{problem.name}-{field.name}" for problem, field in pairs]
    return pytest.mark.parametrize(("problem", "field"), pairs, ids=names)


def refusal(problem: Problem, overrides: dict[str, Any]) -> str:
    """Why a configuration is refused; empty where it is not."""
    try:
        problem.config("paper", overrides)
    except ConfigurationError as error:
        return str(error)
    return ""


@settings(max_examples=400)
@given(data=st.data())
def test_junk_is_refused_by_name(data: st.DataObject) -> None:
    problem, field = data.draw(st.sampled_from(NUMBERS))
    with pytest.raises(ConfigurationError, match=field.name):
        problem.config("paper", {field.name: data.draw(junk(field))})


@settings(max_examples=400)
@given(data=st.data())
def test_a_switch_is_on_or_off(data: st.DataObject) -> None:
    problem, field = data.draw(st.sampled_from(SWITCHES))
    value = data.draw(st.booleans() | junk(field) | st.integers(0, 1))
    refused = refusal(problem, {field.name: value})
    if isinstance(value, bool):  # which may need another field, too
        assert "must be True or False" not in refused
        assert refused or getattr(problem.config("paper", {field.name: value}), field.name) is value
    else:
        assert re.search(f"{field.name}.*must be True or False", refused)


@named(CHOICES)
def test_unknown_choices_are_refused_with_the_known_ones(problem: Problem, field: Field) -> None:
    for value in ("", "papr", field.metadata["choices"][0] + "x", None, 1, True):
        with pytest.raises(ConfigurationError, match=field.metadata["choices"][0]):
            problem.config("paper", {field.name: value})


@named(NUMBERS)
@pytest.mark.parametrize("end", ["low", "high"])
def test_values_out_of_bounds_are_refused_with_the_bounds(problem: Problem, field: Field, end: str) -> None:
    bound = field.metadata[end]
    if math.isinf(bound):
        pytest.skip("has no bound at this end")
    beyond = bound + (1 if end == "high" else -1)
    with pytest.raises(ConfigurationError, match=field.name):
        problem.config("paper", {field.name: (beyond,) if many(field) else beyond})


@named(RANGES)
def test_lists_from_json_are_ranges(problem: Problem, field: Field) -> None:
    preset = "learning" if "learning" in problem.presets else "paper"
    value = getattr(problem.config(preset, {}), field.name)
    ends = value if isinstance(value, tuple) else (value, value)
    assert getattr(problem.config(preset, {field.name: list(ends)}), field.name) == ends


@pytest.mark.parametrize("problem", EVERY, ids=lambda problem: problem.name)
def test_unknown_names_are_refused_with_the_known_ones(problem: Problem) -> None:
    with pytest.raises(ConfigurationError, match="'paper'"):
        problem.config("papr", {})
    name = dataclasses.fields(problem.config("paper", {}))[0].name
    with pytest.raises(ConfigurationError, match=f"'{name}'"):
        problem.config("paper", {name[:-1]: 1})


def edged(name: str, preset: str) -> Subject:
    subject = subject_of(name, preset, "attacker")
    return replace(subject, kwargs={**subject.kwargs, **QUICKER.get(name, {})})


def cases() -> Iterator[object]:
    for name, problem in PROBLEMS.items():
        for preset in problem.presets:
            quick = preset in QUICK and name not in ("fdi", "hvac")  # whose sizes compile kernels of their own
            yield pytest.param(name, preset, marks=() if quick else pytest.mark.slow, id=f"{name}-{preset}")


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")
@pytest.mark.parametrize(("name", "preset"), list(cases()))
def test_what_is_accepted_can_be_played(name: str, preset: str) -> None:
    check_configurations(edged(name, preset), pairs=PAIRS, steps=STEPS)


@pytest.mark.slow
@pytest.mark.parametrize("preset", QUICK)
@pytest.mark.parametrize("name", PROBLEMS)
def test_many_pairs_can_be_played_for_longer(name: str, preset: str) -> None:
    check_configurations(edged(name, preset), pairs=SLOW_PAIRS, steps=SLOW_STEPS)
