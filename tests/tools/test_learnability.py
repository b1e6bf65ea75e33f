"""Ordinary learners learn: what is trained and judged, and that it works in every role (slow)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from cps_agents.errors import CommandError
from cps_envs import PROBLEMS
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.trust import vouched
from cps_envs.core.types import ROLES, other
from tests.agents.command_line import invoke
from tools.command import program
from tools.learnability.__main__ import NAMES, learnability

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from cps_agents.arena.store import Store
from tools.learnability.judging import (
    COLUMNS,
    HELD_OUT,
    Learned,
    constants_of,
    judge,
    native_constants,
    table,
    to_json,
)
from tools.learnability.lessons import Lesson, teach

BUDGET_S = 120.0
SURELY = {"none", "random", "best constant"}


def test_every_role_is_there_with_settings_and_an_opponent_to_hold_out() -> None:
    expected = {class_name(problem, role) for problem in PROBLEMS.values() for role in ROLES}
    assert set(NAMES) == set(HELD_OUT) == expected
    for problem in PROBLEMS.values():
        game = problem.game(problem.presets["learning"], 1)
        for role in ROLES:
            assert adapter_of(game.spec(role), problem.training[role].adapter).agents
            assert problem.training[role].ppo
            for opponent in HELD_OUT[class_name(problem, role)]:
                resolve_policy(opponent, game.spec(other(role)))


def test_constants_are_all_actions_of_an_adapter() -> None:
    duel = PROBLEMS["fdi"].game(PROBLEMS["fdi"].presets["learning"], 1)
    spec, sensors = duel.spec("attacker"), constants_of(duel.spec("defender"), "sensor")
    assert constants_of(spec, "motion") == [f"always?adapter=motion&action={level}" for level in range(9)]
    assert (len(sensors), sensors[1]) == (12, "always?adapter=sensor&action=[0,0,1]")
    assert constants_of(spec, "native") == native_constants(spec) == []
    house = PROBLEMS["hvac"].game(PROBLEMS["hvac"].presets["learning"], 1).spec("defender")
    assert len(native_constants(house)) == house.action_space.n  # among them each set of believed sensors


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("learned")
    for seed in (0, 1):
        teach(Lesson("FdiAttack", seed, 1.0, folder / "FdiAttack" / f"seed-{seed}"))
    return folder


def test_a_lesson_is_kept_and_not_given_twice(taught: Path) -> None:
    folder = taught / "FdiAttack" / "seed-0"
    run = json.loads((folder / "run.json").read_text())
    assert run["cpu_s"] >= 1.0
    assert {path.name for path in folder.iterdir()} >= {"model.zip", "start.zip", "run.json"}
    before = (folder / "model.zip").read_bytes()
    assert teach(Lesson("FdiAttack", 0, 1.0, folder)) == run
    assert (folder / "model.zip").read_bytes() == before
    with pytest.raises(CommandError, match="holds another run"):
        teach(Lesson("FdiAttack", 0, 2.0, folder))


def test_models_are_judged_beside_everything_else_on_the_same_episodes(taught: Path, tmp_path: Path) -> None:
    with vouched():
        found = judge(
            Learned.in_folder("FdiAttack", taught / "FdiAttack"), Store(tmp_path), 1, episodes=4, rivals=False
        )
    assert set(found.rows) == {"none", "random", "start", "best constant"}
    assert found.models.mean.seeds == 2
    assert {each.mean.episodes for each in (found.models, *found.rows.values())} == {4}
    constants = [each for each in found.models.differences if each.startswith("always")]
    assert len(constants) == 9
    best = found.rows["best constant"]
    assert best.policy in constants
    paired = found.models.differences[best.policy].mean
    np.testing.assert_allclose(paired, found.models.mean.mean - best.mean.mean)
    shown = "\n".join(table([found], "t").markdown())
    assert all(column in shown for column in COLUMNS)
    assert to_json([found])[0]["beaten"] == found.beaten()


def test_one_training_seed_is_judged_too(taught: Path, tmp_path: Path) -> None:
    alone = tmp_path / "FdiAttack"
    shutil.copytree(taught / "FdiAttack" / "seed-0", alone / "seed-0")
    with vouched():
        found = judge(Learned.in_folder("FdiAttack", alone), Store(tmp_path / "meetings"), 1, episodes=2, rivals=False)
    assert (found.models.mean.seeds, found.models.mean.episodes) == (1, 2)


def test_the_command_refuses_what_does_not_exist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CPS_ENVS_TRUST", raising=False)
    tool = program(learnability)
    wrong = invoke("RougeAttack", "--out", str(tmp_path), program=tool)
    assert wrong.exit_code != 0
    assert "there is no role 'RougeAttack'. Did you mean 'RogueAttack'" in wrong.output
    untrusted = invoke("FdiAttack", "--out", str(tmp_path), program=tool)
    assert untrusted.exit_code != 0
    assert "--trust" in untrusted.output


def test_shipped_networks_are_judged_without_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tools.learnability.judging.SIDES", {"attacker": "attack", "defender": "nobody"})
    with pytest.raises(CommandError, match=r"no networks of FdiDefense are shipped: .* train FdiDefense-v0"):
        Learned.shipped("FdiDefense")


@pytest.mark.slow
def test_ordinary_learners_learn_at_least_seven_of_eight_roles(tmp_path: Path) -> None:
    learned = []
    for name in NAMES:
        teach(Lesson(name, 0, BUDGET_S, tmp_path / name / "seed-0"))
        with vouched():
            found = judge(Learned.in_folder(name, tmp_path / name), Store(tmp_path / "meetings"), 2, rivals=False)
        if set(found.beaten()) >= SURELY:
            learned.append(name)
    assert len(learned) >= 7, f"only {learned}"
