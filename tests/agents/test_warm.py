from __future__ import annotations

import json
import os
from functools import partial
from typing import Any

import pytest

from cps_agents import warm as warming
from cps_agents.commands import warm as command
from cps_agents.warm import Visit, visits, warm
from cps_envs import PROBLEMS
from cps_envs.core.compute.compiling import compiled, told
from cps_envs.core.compute.kernel_cache import UNKEPT
from cps_envs.core.compute.shipped import NATIVE
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.policies.lookup import policy_names
from cps_envs.core.types import ROLES
from cps_paper.testbed.robots.problem import TESTBED
from tests.agents import command_line
from tests.core.toy import TOY

invoke = partial(command_line.invoke, "warm", "--jobs", "1")


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=lambda problem: problem.name)
def test_presets_and_policies_are_visited(problem: Any) -> None:
    uses = [visit.what for visit in visits(problem)]
    assert len(set(uses)) == len(uses)
    assert {*problem.presets, *(f"{role}, vector" for role in ROLES)} <= set(uses)
    assert {f"{role} {name}" for role in ROLES for name in policy_names(problem.name, role)} <= set(uses)
    assert any("zoo:" in use for use in uses)


def test_nothing_is_left_to_compile_after_warming() -> None:
    found = warm("toy", [*visits(TOY), *visits(TESTBED)])
    assert found.failed == []
    before = list(compiled)
    for visit in visits(TOY):
        visit.play()
    env = RolesParallelEnv(TOY)
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    assert compiled == before
    assert found.uses == len(list(visits(TOY))) + len(list(visits(TESTBED)))


@pytest.mark.parametrize(
    ("problem", "name", "preset"), [("disbanding", "joint", "paper"), ("rogue", "escort", "learning")]
)
def test_policies_are_warmed_by_an_opponent_and_in_a_preset_that_they_can_play(
    problem: str, name: str, preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, plays = [], warming._match

    def match(problem: Any, preset: str, overrides: Any, players: Any) -> None:
        plays(problem, preset, overrides, players)
        found.append((preset, overrides, players["attacker"]))

    monkeypatch.setattr(warming, "_match", match)
    warming._policy(PROBLEMS[problem], "defender", name)
    assert found == [(preset, {}, PROBLEMS[problem].opponents[preset]["attacker"])]


@pytest.fixture
def little(monkeypatch: pytest.MonkeyPatch) -> list[Visit]:
    """What a problem's visits are for the command."""
    uses = [Visit("rogue", "in passing", lambda: None)]
    monkeypatch.setattr("cps_agents.commands.warm.visits", lambda problem: iter(uses))
    return uses


@pytest.mark.usefixtures("little")
def test_the_command_reports_each_problem() -> None:
    robots = "cps_paper.testbed.robots.problem:TESTBED"
    result = command_line.succeeded("warm", "--jobs", "1", "--problem", "rogue", "--problem", robots, "--json")
    found = json.loads(result.stdout)
    assert [each["problem"] for each in found["problems"]] == ["rogue", "testbed"]
    assert found["kept"]
    assert found["problems"][0]["uses"] == 1
    assert "rogue: 0 kernels compiled" in result.stderr
    table = invoke().stdout
    assert all(name in table for name in PROBLEMS)


def test_the_command_goes_on_after_a_failure_and_says_so(little: list[Visit]) -> None:
    def broken() -> None:
        raise ZeroDivisionError("nobody [expected] this")

    little.insert(0, Visit("rogue", "badly", broken))
    result = invoke("--problem", "rogue", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["problems"][0]["uses"] == 2
    assert "rogue, badly: ZeroDivisionError: nobody [expected] this" in result.stderr


@pytest.mark.usefixtures("little")
def test_the_command_says_when_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cps_agents.warm.told", told | {UNKEPT})
    result = invoke("--problem", "rogue", "--json")
    assert (result.exit_code, json.loads(result.stdout)["kept"]) == (1, False)


def test_an_interrupt_gives_130(little: list[Visit]) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    little.append(Visit("rogue", "until somebody presses Ctrl-C", interrupted))
    assert invoke("--problem", "rogue").exit_code == 130


def test_it_compiles_for_this_processor_also_where_kernels_came_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(NATIVE, "0")
    asked: list[str] = []
    monkeypatch.setattr(command, "warm_up", lambda *_: asked.append(os.environ[NATIVE]))
    command._one(("toy", []))
    assert asked == ["1"]
