"""Networks that remember, taught over whole episodes by a teacher that knows more than they do."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import torch

from cps_agents.errors import CommandError
from cps_agents.learning.demonstrations import opponent_of, teacher_of
from cps_agents.learning.export import network_of_model
from cps_agents.learning.imitation import (
    collect,
    imitate_sequences,
    joined,
    outputs_of,
    read_sequences,
    sequence_loss,
    write_sequences,
)
from cps_agents.learning.learner import learn
from cps_agents.learning.model import check_fit
from cps_agents.learning.recipe import IMITATION, Recipe, changed
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.training_envs import make_envs
from cps_agents.zoo.files import load
from cps_envs.registration import find_problem
from tests.agents.test_learning_parts import CASES, ROGUE, SWARM, build

TAUGHT = replace(
    ROGUE,
    algorithm=IMITATION,
    teachers={"pd": "square?frequency_hz=0.5", "sliding": "square?frequency_hz=1"},
    overrides={"duration_s": 3.0, "onset_s": 0.0},
    variations=({"power_ratio": 1.0}, {"power_ratio": 1.3}),
    teacher_episodes=4,
    teacher_epochs=3,
    total_steps=3 * 4 * 30,
    memory_units=8,
    evaluation_episodes=4,
)
DISCRETE = replace(CASES["maskable-ppo"], algorithm=IMITATION, teacher="oracle", teacher_episodes=3, memory_units=8)


def job(folder: Path, recipe: Recipe = TAUGHT, **changes: Any) -> TrainingJob:
    return TrainingJob(recipe, 0, folder, "cps-envs train", **changes)


def rows_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "evaluations.jsonl").read_text().splitlines()]


def test_each_opponent_meets_its_teacher() -> None:
    game = find_problem("rogue").game(find_problem("rogue").config("easy", {}), 1)
    teachers, opponents = teacher_of(TAUGHT, game), opponent_of(TAUGHT, game)
    dealt = teachers.draw(np.random.default_rng(0).spawn(5))  # type: ignore[attr-defined]
    assert dealt.tolist() == [0, 1, 0, 1, 0] == opponents.draw(np.random.default_rng(1).spawn(5)).tolist()  # type: ignore[union-attr]
    shown = collect(replace(TAUGHT, variations=()), range(4))
    changes = np.abs(np.diff(shown.actions[..., 0], axis=1)).argmax(axis=1)
    assert changes[0] > changes[1]
    assert changes.tolist() == [*changes[:2], *changes[:2]]


def test_sequences_are_sorted_by_episode_and_kept(tmp_path: Path) -> None:
    shown = collect(TAUGHT, range(4))
    assert shown.observations.shape[:2] == shown.valid.shape == (4, 30)
    assert shown.valid.all()
    left = np.diff(shown.observations[..., -1], axis=1)  # the time that is left
    assert (left < 0).all()
    names = ("observations", "actions", "valid")
    longer = joined([shown, replace(shown, **{name: getattr(shown, name)[:, :10] for name in names})])
    assert longer.valid.sum() == 4 * 30 + 4 * 10
    write_sequences(tmp_path / "a" / "round.safetensors", shown)
    again = read_sequences(tmp_path / "a" / "round.safetensors")
    np.testing.assert_array_equal(again.observations, shown.observations)
    assert again.masks is None


def test_legal_actions_travel_with_discrete_ones(tmp_path: Path) -> None:
    shown = collect(DISCRETE, range(3))
    assert shown.masks is not None
    write_sequences(tmp_path / "round.safetensors", shown)
    np.testing.assert_array_equal(read_sequences(tmp_path / "round.safetensors").masks, shown.masks)
    model, _ = build(DISCRETE)
    before = float(sequence_loss(model.policy, shown, np.arange(3), "squared").detach())
    loss = imitate_sequences(model.policy, shown, replace(DISCRETE, teacher_epochs=120), np.random.default_rng(0))
    assert loss < 0.5 * before


def test_a_team_is_as_many_episodes_as_agents() -> None:
    recipe = replace(SWARM, algorithm=IMITATION, teacher="feedback")
    shown = collect(recipe, range(2))
    assert shown.observations.shape == (2 * 9, 6, 22)


@pytest.mark.parametrize("loss", ["squared", "logistic"])
def test_what_only_the_past_tells_is_learned(loss: str) -> None:
    """The sign of the wave cannot be read from the observation here, only counted."""
    recipe = replace(TAUGHT, teacher_loss=loss, teachers={"pd": "square?frequency_hz=0.5"}, unseen=("time_left_s",))
    recipe = replace(recipe, teacher_epochs=150, memory_units=16, batch_size=60)
    shown = collect(recipe, range(4))
    model, _ = build(recipe)
    imitate_sequences(model.policy, shown, recipe, np.random.default_rng(0))
    with torch.no_grad():
        played = outputs_of(model.policy, torch.as_tensor(shown.observations)).clamp(-1, 1).numpy()
    assert np.mean((np.sign(played) == np.sign(shown.actions))[shown.valid]) > 0.95


def test_the_exported_network_remembers_like_the_model() -> None:
    shown = collect(TAUGHT, range(4))
    model, _ = build(TAUGHT)
    imitate_sequences(model.policy, shown, TAUGHT, np.random.default_rng(0))
    network = network_of_model(model, TAUGHT.activation)
    hidden = cell = np.zeros((4, network.units), np.float32)
    with torch.no_grad():
        outputs = outputs_of(model.policy, torch.as_tensor(shown.observations)).numpy()
    for step in range(30):
        found, hidden, cell = network.forward(shown.observations[:, step], hidden, cell)
        np.testing.assert_allclose(found, outputs[:, step], atol=1e-5)


def test_a_run_leaves_a_policy_that_plays(tmp_path: Path) -> None:
    found = learn(job(tmp_path))
    assert (found["status"], found["steps"]) == ("finished", 360)
    rows = rows_of(tmp_path)
    assert [row["steps"] for row in rows] == [120, 240, 360]
    card, network = load(tmp_path / "policy.json")
    assert (card.algorithm, network.units) == (IMITATION, 8)
    assert card.seeds["0"]["validation"] == max(row["validation"] for row in rows)
    assert not (tmp_path / "demonstrations").exists()
    assert list((tmp_path / "tensorboard").rglob("events*"))


def test_a_run_that_goes_on_after_a_round_is_the_run_that_never_stopped(tmp_path: Path) -> None:
    def stop(steps: int, note: str) -> None:
        if steps >= 240:
            signal.raise_signal(signal.SIGTERM)

    learn(job(tmp_path / "whole"))
    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path / "parts"), stop)
    stopped = json.loads((tmp_path / "parts" / "run.json").read_text())
    assert (stopped["status"], stopped["steps"]) == ("interrupted", 240)
    load(tmp_path / "parts" / "policy.json")
    found = learn(job(tmp_path / "parts", resume=True))
    assert found["cpu_s"] >= stopped["cpu_s"] > 0
    scores = [[row["validation"] for row in rows_of(tmp_path / name)] for name in ("whole", "parts")]
    assert scores[0] == scores[1]
    first, second = (load(tmp_path / name / "policy.json")[1].tensors() for name in ("whole", "parts"))
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name])


def test_damaged_demonstrations_are_named(tmp_path: Path) -> None:
    def stop(steps: int, note: str) -> None:
        if steps > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path), stop)
    (tmp_path / "demonstrations" / "round-0.safetensors").write_bytes(b"PK")
    with pytest.raises(CommandError, match=r"round-0\.safetensors is damaged"):
        learn(job(tmp_path, resume=True))


def test_recurrent_ppo_goes_on_from_a_teacher(tmp_path: Path) -> None:
    recipe = replace(
        TAUGHT, algorithm="recurrent-ppo", teacher_rounds=2, total_steps=128, value_warm_up=1, evaluations=1
    )
    check_fit(recipe, make_envs(recipe, 0))
    notes: list[str] = []
    found = learn(job(tmp_path, recipe), lambda steps, note: notes.append(note))
    assert found["status"] == "finished"
    assert sum("imitation, round" in note for note in notes) == 2
    rows = rows_of(tmp_path)
    assert [row["steps"] for row in rows] == [0, 128]
    card, _ = load(tmp_path / "policy.json")
    assert card.algorithm == ("imitation" if rows[0]["validation"] >= rows[1]["validation"] else "recurrent-ppo")


def test_imitation_needs_a_teacher() -> None:
    with pytest.raises(CommandError, match="needs a teacher"):
        replace(ROGUE, algorithm=IMITATION)
    with pytest.raises(CommandError, match="squared, logistic"):
        replace(ROGUE, teacher_loss="cubic")


def test_another_opponent_needs_a_teacher() -> None:
    assert changed(TAUGHT, {"opponent": "pd"}).teachers == {"pd": TAUGHT.teachers["pd"]}
    with pytest.raises(CommandError, match=r"no teacher against 'slding'.*Did you mean 'sliding'.*--knob"):
        changed(TAUGHT, {"opponent": "slding"})
