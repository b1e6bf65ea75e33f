"""Ordinary learners learn: PPO of stable-baselines3 with the settings of each role, in two CPU minutes (slow)."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.evaluation import compare, is_better
from cps_envs import PROBLEMS
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.policies.trust import vouched
from cps_envs.core.types import ROLES, Role, other
from tests.episodes import spec_of
from tools.challenge.constants.adapters import constants_of, native_constants

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

PRESET, BUDGET_S = "learning", 120.0
EPISODES = {"rogue": 200, "fdi": 400, "hvac": 400, "disbanding": 200}  # chosen: seconds each


def test_constants_are_all_actions_of_an_adapter() -> None:
    duel = PROBLEMS["fdi"].game(PROBLEMS["fdi"].presets[PRESET], 1)
    spec, sensors = duel.spec("attacker"), constants_of(duel.spec("defender"), "sensor")
    assert constants_of(spec, "motion") == [f"always?adapter=motion&action={level}" for level in range(9)]
    assert (len(sensors), sensors[1]) == (12, "always?adapter=sensor&action=[0,0,1]")
    assert constants_of(spec, "native") == native_constants(spec) == []
    house = spec_of(PROBLEMS["hvac"], "defender", PRESET)
    assert len(native_constants(house)) == house.action_space.n  # among them each set of believed sensors


def taught(name: str, folder: Path, cpu_s: float) -> Path:
    """A model that PPO has trained for so many CPU seconds, those of the environments included."""
    import torch
    from stable_baselines3 import PPO

    from cps_agents.sb3 import StickyPolicy, make

    torch.set_num_threads(1)
    envs = make(name)
    model = PPO(StickyPolicy, envs, seed=0, **envs.settings)
    began, planned = time.process_time(), model.lr_schedule
    model.lr_schedule = lambda _: planned(max(1.0 - (time.process_time() - began) / cpu_s, 0.0))
    model.learn(10**12, callback=lambda *_: time.process_time() - began < cpu_s)
    model.lr_schedule = planned
    model.save(folder / f"{name}.zip")
    return folder / f"{name}.zip"


def not_beaten(problem: str, role: Role, model: Path, store: Store, episodes: int) -> list[str]:
    """Of doing nothing, random play and the constants those that a model does not surely beat, in pairs."""
    found, venue = PROBLEMS[problem], Venue(problem, PRESET)
    spec, training = spec_of(found, role, PRESET), found.training[role]
    simple = ["none", "random", *constants_of(spec, training.adapter), *native_constants(spec)]
    learned = Contestant(f"sb3:{model}{'?sampled=true' if training.sampled else ''}")
    rival = Contestant(found.opponents[PRESET][other(role)])
    attackers, defenders = ([learned], [rival]) if role == "attacker" else ([rival], [learned])
    table = Table(venue, attackers, defenders, episodes, judged=role, bars=list(map(Contestant, dict.fromkeys(simple))))
    with vouched():
        standings, _ = compare(table, store, 2)
    (differences,) = (each.differences for each in standings if each.policy == learned.name)
    return [name for name in simple if not is_better(differences[name], role)]


def test_a_model_is_compared_with_every_constant(tmp_path: Path) -> None:
    model = taught("FdiAttack", tmp_path, 1.0)
    assert len(not_beaten("fdi", "attacker", model, Store(tmp_path / "meetings"), 4)) <= 2 + 9


@pytest.mark.slow
def test_ordinary_learners_learn_at_least_seven_of_eight_roles(tmp_path: Path) -> None:
    learned = []
    for problem in PROBLEMS:
        for role in ROLES:
            name = class_name(PROBLEMS[problem], role)
            model = taught(name, tmp_path, BUDGET_S)
            if not not_beaten(problem, role, model, Store(tmp_path / "meetings"), EPISODES[problem]):
                learned.append(name)
    assert len(learned) >= 7, f"only {learned}"
