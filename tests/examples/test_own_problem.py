"""The problem in one file: through every public check, the command line and the documents."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_agents.catalogue import describe_problem
from cps_envs import find_problem
from cps_envs.core.conformance import CHECKS, Check, find_subject, run_check
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies import lookup
from tests.agents.command_line import refusal, succeeded
from tools.pages import environments

FOLDER = Path(__file__).parents[2] / "examples"
MINUTE = {"duration_s": 60}


@pytest.fixture(autouse=True)
def _own_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    """The examples can be imported, by processes that tests start too."""
    monkeypatch.syspath_prepend(str(FOLDER))
    monkeypatch.setenv("PYTHONPATH", str(FOLDER), prepend=os.pathsep)


@pytest.fixture
def tank() -> Problem:
    return find_problem("own_problem:TANK")


EACH_SIDE = [  # the checks take turns with the sides; all are made in the slow run
    pytest.param(side, check, id=f"{side}-{check.__name__}", marks=() if place % 2 == turn else (pytest.mark.slow,))
    for place, check in enumerate(CHECKS)
    for turn, side in enumerate(("Attack", "Defense"))
]


@pytest.mark.parametrize(("side", "check"), EACH_SIDE)
def test_it_conforms(side: str, check: Check, tank: Problem) -> None:
    variants = [{"preset": "learning"}, {"preset": "learning", "opponent": "none"}]
    subject = find_subject(f"own_problem:own_problem/Tank{side}-v0", MINUTE, variants)
    if run_check(check, subject).status == "skipped":
        assert check.__name__ in ("check_swarm", "check_live_swarm", "check_action_masks", "check_flat", "check_cost")


def test_the_program_prints_every_meeting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CPS_ENVS_TRUST")
    program = [sys.executable, str(FOLDER / "own_problem.py")]
    lines = subprocess.run(program, check=True, capture_output=True, text=True).stdout.splitlines()
    payoffs = {tuple(line.split()[:3:2]): float(line.split()[3]) for line in lines}
    assert len(payoffs) == 9
    assert payoffs["Bias", "none"] > 2 * payoffs["none", "none"]  # the attack does harm
    assert payoffs["Bias", "Doubt"] < payoffs["Bias", "none"]  # doubting the sensor helps
    assert payoffs["Bias?rise_s=60", "Doubt"] > payoffs["Bias", "Doubt"]  # a slow bias is not noticed


def test_the_command_line_plays_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CPS_ENVS_TRUST", "0")  # put back afterwards
    picture = tmp_path / "tank.png"
    pytest.importorskip("pygame")
    arguments = ["--trust", "play", "own_problem:TANK", "--set", "duration_s=20", "--json"]
    result = succeeded(*arguments, "--attacker", "own_problem:Bias?rise_s=9", "--render", str(picture))
    assert "error_ms" in json.dumps(json.loads(result.stdout))
    assert picture.stat().st_size > 0
    assert "Told:" not in succeeded("list", "own_problem:TANK").output  # nobody is
    plain = succeeded("play", "own_problem:TANK", "--set", "duration_s=20").output
    assert "The return is the attacker's, in m s: error_ms + flood_fee_ms" in " ".join(plain.split())


def test_every_command_of_the_arena_takes_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It trains, and its trained policy plays in a league and is judged."""
    for extra in ("scipy", "matplotlib", "torch"):
        pytest.importorskip(extra)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CPS_ENVS_MEETINGS", str(tmp_path / "meetings"))

    def command(words: str) -> str:
        return " ".join(succeeded(*words.split(), "--jobs", "1").output.split())

    tiny = "--knob num_envs=4 --knob n_steps=32 --knob evaluation_episodes=2 --seeds 1 --steps 128"
    command(f"train own_problem:own_problem/TankAttack-v0 {tiny}")
    mine, every = "zoo:runs/tank-attack/seed-0", "league own_problem:TANK --attacker all --episodes 20"
    assert "Value of the game" in command(f"{every} --attacker {mine}")
    assert "Reused 9 of 18 meetings" in command("reproduce benchmark own_problem:TANK")
    judged = command(f"evaluate own_problem:TANK attacker --attacker {mine} --baseline own_problem:Bias --episodes 20")
    assert "Reused 2 of 2 meetings" in judged
    assert "attacker against own_problem:Doubt: return, m s" in judged
    response = command(f"best-response own_problem:TANK defender --attacker {mine} {tiny} --episodes 20")
    assert "Over the best policy known before" in response
    searched = "best-response own_problem:TANK attacker --defender own_problem:Doubt --oracle search --budget 1 --out s"
    assert "own_problem:Bias?rise_s=" in command(f"{searched} --episodes 20 --seeds 1")
    assert json.loads((tmp_path / "league" / "tank.json").read_text())["problem"] == "tank"


def test_all_stands_for_everybody_who_can_play_and_what_is_broken_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = EntryPoint("tank.attacker.broken", "nowhere:Policy", lookup.GROUP)
    monkeypatch.setattr(lookup, "_registered", lambda group=lookup.GROUP: {broken.name: broken})
    monkeypatch.chdir(tmp_path)
    few = "--set duration_s=20 --episodes 1 --jobs 1 --json"
    words = f"evaluate own_problem:TANK defender --attacker all --defender all {few}"
    result = succeeded(*words.split())
    met = [(each["opponent"], each["policy"]) for each in json.loads(result.stdout)["standings"]]
    attackers, defenders = (["none", "random", f"own_problem:{own}"] for own in ("Bias", "Doubt"))
    assert met == [(attacker, defender) for attacker in attackers for defender in defenders]
    assert "Left out: attacker broken: the entry point tank.attacker.broken names nowhere:Policy" in result.stderr


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        ("list own_problem", "One of your own is written MODULE:PROBLEM, behind --trust"),
        ("score tank-defense own_problem:Doubt", "A problem of your own has none: judge it with evaluate or league"),
        ("train own_problem:own_problem/TankAttak-v0", "Did you mean 'own_problem:own_problem/TankAttack-v0'"),
        ("train own_problem:own_problem/TankAttack-v0 --algo cma-es", "--knob family=NAME, with own_problem:BIAS"),
    ],
)
def test_a_refusal_says_what_to_do(words: str, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert advice in refusal(*words.split())


def test_the_documents_describe_it(tank: Problem) -> None:
    page = "\n".join(environments.page(tank, "defender"))
    assert "own_problem.parallel_env" in "\n".join(environments.shared(tank))
    assert "| 0 | `level` |" in page
    assert "[the list with units, bounds and sources](tank.md#arguments)" in page
    assert "`correction_per_s`" in "\n".join(environments.shared(tank))
    assert "own_problem:own_problem/TankDefense-v0" in page
    assert describe_problem(tank)["pettingzoo"]["parallel"] == "own_problem.parallel_env"


def test_a_bias_that_reads_low_floods_a_low_tank(tank: Problem) -> None:
    env: Any = gymnasium.make("own_problem:own_problem/TankAttack-v0", preset="paper", height_m=1.2, opponent="none")
    env.reset(seed=0)
    for _ in range(120):
        _, _, terminated, _, info = env.step(np.array([-1.0], np.float32))
        if terminated:
            break
    assert terminated
    assert info["flood_fee_ms"] == 30.0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own_problem:TONK", "no problem can be imported from 'own_problem:TONK'"),
        ("nowhere:TANK", "No module named 'nowhere'"),
        ("own_problem:main", "is no problem but"),
        ("disbandin", "Did you mean 'disbanding'"),
    ],
)
def test_a_wrong_name_is_refused(name: str, message: str) -> None:
    importlib.import_module("own_problem")
    with pytest.raises(UnknownNameError, match=message):
        find_problem(name)
