"""Every problem under the edges of its configurations, for a few seconds here and for minutes in the slow tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance import Subject, check_configurations
from tests.test_conformance import subject_of

QUICK = ("paper", "learning")
PAIRS, SLOW_PAIRS, SLOW_STEPS = 20, 1000, 100

QUICKER: Mapping[str, Any] = {"hvac": {"prediction_steps": 10}}  # its gains take a second at 80 steps


def edged(name: str, preset: str) -> Subject:
    subject = subject_of(name, preset, "attacker")
    return replace(subject, kwargs={**subject.kwargs, **QUICKER.get(name, {})})


def cases() -> Iterator[object]:
    for name, problem in PROBLEMS.items():
        for preset in problem.presets:
            yield pytest.param(name, preset, marks=() if preset in QUICK else pytest.mark.slow, id=f"{name}-{preset}")


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")
@pytest.mark.parametrize(("name", "preset"), list(cases()))
def test_what_is_accepted_can_be_played(name: str, preset: str) -> None:
    check_configurations(edged(name, preset), pairs=PAIRS)


@pytest.mark.slow
@pytest.mark.parametrize("preset", QUICK)
@pytest.mark.parametrize("name", PROBLEMS)
def test_many_pairs_can_be_played_for_longer(name: str, preset: str) -> None:
    check_configurations(edged(name, preset), pairs=SLOW_PAIRS, steps=SLOW_STEPS)
