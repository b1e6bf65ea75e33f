"""Descent as a learner: whole runs, interrupted ones, and what they need."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.errors import CommandError
from cps_agents.learning.descent import CHECKPOINT, Adam, shortened
from cps_agents.learning.learner import learn
from cps_agents.learning.recipe import Recipe, Scene
from cps_agents.learning.run import Job
from cps_agents.recipes.finding import RECIPES
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find, load
from cps_envs.core.documents import DamagedFileError

SHORT = {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0, "report": "safety"}
RECIPE = replace(
    RECIPES["disbanding-defense-residual"],
    overrides=SHORT,
    scenes=(Scene(2, "lead"), Scene(1, "timed?pause_s=8", "easy", {"attack_budget": 2})),
    total_steps=3 * 6,
    evaluations=3,
    evaluation_episodes=3,
)


def job(folder: Path, recipe: Recipe = RECIPE, **changes: Any) -> Job:
    return Job(recipe, changes.pop("seed", 1), folder, "cps-envs train", **changes)


def numbers(path: Path, seed: int | None = None) -> np.ndarray:
    return load(path, seed)[1].tensors()["numbers"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that was never stopped."""
    folder = tmp_path_factory.mktemp("whole")
    learn(job(folder))
    return folder


def test_a_run_improves_on_its_teacher_and_keeps_its_numbers(whole: Path) -> None:
    run = json.loads((whole / "run.json").read_text())
    assert (run["status"], run["steps"]) == ("finished", 18)
    scores = [json.loads(line)["validation"] for line in (whole / "evaluations.jsonl").read_text().splitlines()]
    assert max(scores) > scores[0]
    card = read_card(whole / "policy.json")
    assert (card.algorithm, card.family) == ("gradient", "disbanding-broadcast-residual")
    taught = numbers(find("disbanding-defense-cma"), 1)
    np.testing.assert_array_equal(numbers(whole / "policy.json")[: len(taught)], taught)


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_descent_goes_on_to_the_same_result(whole: Path, tmp_path: Path, stop: signal.Signals) -> None:
    def interrupt(steps: int, note: str) -> None:
        if steps == 9:
            signal.raise_signal(stop)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), interrupt)
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
    assert learn(job(tmp_path, resume=True))["status"] == "finished"
    assert (tmp_path / CHECKPOINT).read_text() == (whole / CHECKPOINT).read_text()
    np.testing.assert_array_equal(numbers(tmp_path / "policy.json"), numbers(whole / "policy.json"))


def test_a_damaged_checkpoint_is_named(whole: Path, tmp_path: Path) -> None:
    kept = json.loads((whole / CHECKPOINT).read_text())
    (tmp_path / CHECKPOINT).write_text(json.dumps({**kept, "point": [1.0]}))
    run = json.loads((whole / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps({**run, "status": "interrupted"}))
    with pytest.raises(DamagedFileError, match=r"descent\.json"):
        learn(job(tmp_path, resume=True))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"family": "disbanding-broadcast"}, "has no gradients"),
        ({"teacher": ""}, "needs a teacher"),
        ({"teacher": "zoo:disbanding-defense-local-cma"}, "ahead_closing is missing"),
    ],
)
def test_what_a_descent_needs_is_told(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(CommandError, match=message):
        learn(job(tmp_path, replace(RECIPE, **changes)))


def test_one_long_gradient_counts_a_few_times_as_much_as_the_others() -> None:
    gradients = np.array([[1.0, 0.0], [0.0, 1.0], [3e3, 4e3]])
    np.testing.assert_allclose(shortened(gradients), [(1.0 + 6.0) / 3, (1.0 + 8.0) / 3])


def test_the_first_step_has_the_length_of_the_rate() -> None:
    adam = Adam(*np.zeros((3, 2))).moved(np.array([5.0, -0.1]), 0.05, 1)
    np.testing.assert_allclose(adam.point, [0.05, -0.05], rtol=1e-4)
