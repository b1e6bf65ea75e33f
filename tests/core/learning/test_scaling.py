"""The scale of learners' inputs: what ships, what is measured, and what it depends on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.learning import scaling
from cps_envs.core.learning.scaling import measure, scaling_key
from cps_envs.core.learning.wiring import Wiring
from tests.core.learned_toy import LEARNED, LearnedDefenseEnv, LearnedDefenseVectorEnv
from tools.scaling import as_text, main, statistics

WIRING = Wiring("toy", "defender", "axis", 4, (3.0, 6.0))
CONFIG = LEARNED.config("learning", {})


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What users are told of measurements, none of which has been made."""
    found: list[str] = []
    monkeypatch.setattr(scaling, "_measured", {})
    monkeypatch.setattr(scaling, "tell", found.append)
    return found


def shipping(path: Path) -> Problem:
    """The toy with a file of statistics."""
    problem = replace(LEARNED, scaling=path)
    path.write_text(as_text(statistics(problem)))
    return problem


def made(problem: Problem, **options: Any) -> Any:
    """The wiring of an environment of its defender."""
    kind = type("Made", (RoleEnv,), {"problem": problem, "role": "defender", "__doc__": "The guard."})
    return kind(**options).observation_space.wiring


def test_what_ships_is_what_a_measurement_gives(tmp_path: Path, told: list[str]) -> None:
    problem = shipping(tmp_path / "scaling.json")
    wiring = made(problem)
    assert told == []
    assert (wiring.mean, wiring.deviation) == measure(LEARNED, CONFIG, "learning", WIRING)
    assert (made(LEARNED).mean, len(told)) == (wiring.mean, 1)


def test_another_configuration_measures_once_and_says_so(tmp_path: Path, told: list[str]) -> None:
    problem = shipping(tmp_path / "scaling.json")
    other = [made(problem, drift=0.2) for _ in range(2)]
    assert told == ["cps_envs: measuring the scale of inputs once (Toy, defender: not the shipped settings)"]
    assert other[0] == other[1]
    assert other[0].mean != made(problem).mean
    assert len(told) == 1


def test_a_file_is_read_by_what_it_is_about(tmp_path: Path, told: list[str]) -> None:
    path = tmp_path / "scaling.json"
    problem = shipping(path)
    kept = json.loads(path.read_text())
    facts = kept[scaling_key(problem, CONFIG, WIRING)]
    facts["mean"] = [0.25] * len(facts["mean"])
    path.write_text(json.dumps(kept))
    scaling.shipped.cache_clear()
    assert set(made(problem).mean) == {0.25}


def test_statistics_that_are_given_are_obeyed(told: list[str]) -> None:
    given = ((0.5,) * 6, (2.0,) * 6)
    env, raw = LearnedDefenseEnv(scaling=given), LearnedDefenseEnv(scaling=((), ()))
    one, two = env.reset(seed=1)[0], raw.reset(seed=1)[0]
    columns = env.observation_space.columns  # type: ignore[attr-defined]
    np.testing.assert_allclose(one[: columns.scaled], (two[: columns.scaled] - 0.5) / 2.0, rtol=1e-6)
    assert told == []


def test_one_environment_has_the_inputs_of_a_batch(told: list[str]) -> None:
    single, batch = LearnedDefenseEnv(), LearnedDefenseVectorEnv(3)
    np.testing.assert_array_equal(single.reset(seed=5)[0], batch.reset(seed=5)[0][0])
    assert len(told) == 1


def test_a_key_stands_for_what_the_statistics_depend_on() -> None:
    wirings = [
        WIRING,
        replace(WIRING, frame_skip=2),
        replace(WIRING, adapter="native"),
        replace(WIRING, recent_s=()),
        replace(WIRING, rough_s=1.0),
    ]
    keys = [scaling_key(LEARNED, CONFIG, each) for each in wirings]
    keys += [scaling_key(LEARNED, replace(CONFIG, drift=0.1), WIRING)]
    keys += [scaling_key(replace(LEARNED, version=1), CONFIG, WIRING)]
    assert len(set(keys)) == len(keys)
    alike = [replace(WIRING, joint=True), replace(WIRING, mean=(0.0,), deviation=(1.0,)), replace(WIRING, flat=True)]
    assert {scaling_key(LEARNED, CONFIG, each) for each in alike} == {keys[0]}


SHIPS = any(problem.scaling is not None and problem.scaling.is_file() for problem in PROBLEMS.values())


@pytest.mark.skipif(not SHIPS, reason="no scale ships yet: python -m tools.scaling")
def test_what_ships_is_of_the_settings_of_now(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check"]) == 0, capsys.readouterr().out
