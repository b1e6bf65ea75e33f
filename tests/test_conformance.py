"""Every registered environment, in every preset, through the public conformance checks."""

from __future__ import annotations

import math
from collections.abc import Iterator

import gymnasium
import pettingzoo
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance import CHECKS, Check, Subject, find_subject, run_check
from cps_envs.core.types import ROLES, SIGN, Role
from tests.settings import tests_of as settings_of

ELSEWHERE = ("check_configurations",)  # tests/test_configurations.py
ONCE = ("check_live_observations", "check_live_swarm", "check_subprocess")  # do not depend on the preset


def cases() -> Iterator[object]:
    for name, problem in PROBLEMS.items():
        for preset in problem.presets:
            for role in ROLES:
                for check in CHECKS:
                    if check.__name__ not in ELSEWHERE and (check.__name__ not in ONCE or preset == "paper"):
                        yield pytest.param(name, preset, role, check, id=f"{name}-{preset}-{role}-{check.__name__}")


def subject_of(name: str, preset: str, role: Role) -> Subject:
    settings = settings_of(name)
    env_id = f"cps_envs:{PROBLEMS[name].env_id(role)}"
    return find_subject(env_id, {"preset": preset, **settings.short}, settings.variants.get(role, ()))


@pytest.mark.parametrize(("name", "preset", "role", "check"), list(cases()))
def test_conformance(name: str, preset: str, role: Role, check: Check) -> None:
    outcome = run_check(check, subject_of(name, preset, role))
    if outcome.status == "skipped":
        pytest.skip(outcome.reason)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("name", PROBLEMS)
def test_full_length_return_is_the_published_metric(name: str, role: Role) -> None:
    env = gymnasium.make(f"cps_envs:{PROBLEMS[name].env_id(role)}", preset="paper").unwrapped
    neutral = env.game.neutral_action[role]
    _, info = env.reset(seed=0)
    rewards, ended = [], False
    while not ended:
        _, reward, terminated, truncated, info = env.step(neutral)
        rewards.append(reward)
        ended = terminated or truncated
    metric = sum(info[part] for part in env.game.payoff_parts)
    assert SIGN[role] * math.fsum(rewards) == pytest.approx(metric, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", PROBLEMS)
def test_pettingzoo_knows_the_problem(name: str) -> None:
    problem = PROBLEMS[name]
    env = pettingzoo.make("parallel", f"cps_envs/{name}-v{problem.version}", **settings_of(name).short)
    observations, _ = env.reset(seed=0)
    assert set(observations) == set(env.possible_agents)


def test_every_problem_has_settings() -> None:
    missing = [name for name in PROBLEMS if not settings_of(name).golden]
    assert not missing, f"describe {missing} in tests/settings.py: short episodes, variants, golden cases"
