"""Every registered environment through the public conformance checks; steps at once, and games that are copies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance import CHECKS, LEARNING_CHECKS, Check, Subject, find_subject, run_check
from cps_envs.core.conformance.actors import Actor
from cps_envs.core.game.game import Game
from cps_envs.core.types import ROLES, SIGN, Array, Role
from tests.episodes import started
from tests.settings import tests_of as settings_of

ELSEWHERE = ("check_configurations", "check_copies")  # tests/test_configurations.py, tests/test_copies.py
ONCE = ("check_live_observations", "check_live_swarm", "check_subprocess")  # do not depend on the preset
QUICK = ("paper", "learning")  # presets of checks that are not slow; each preset has its golden trajectories, too
ALL = np.ones(2, bool)
PRESETS = [(name, preset) for name, problem in PROBLEMS.items() for preset in problem.presets]


def is_quick(place: int, role: Role, preset: str | None = None) -> bool:
    """Whether a check is not slow: of a problem each is quick for one role and in one preset, which take turns."""
    turn, of_role = divmod(place, len(ROLES))
    return role == ROLES[of_role] and preset in (None, QUICK[turn % len(QUICK)])


def cases() -> Iterator[object]:
    for name, problem in PROBLEMS.items():
        for preset in problem.presets:
            for role in ROLES:
                for place, check in enumerate(CHECKS):
                    if check.__name__ not in ELSEWHERE and (check.__name__ not in ONCE or preset == "paper"):
                        quick = is_quick(place, role, None if check.__name__ in ONCE else preset)
                        marks = () if quick else (pytest.mark.slow,)
                        case = f"{name}-{preset}-{role}-{check.__name__}"
                        yield pytest.param(name, preset, role, check, id=case, marks=marks)


def subject_of(name: str, preset: str, role: Role, **options: Any) -> Subject:
    settings = settings_of(name)
    env_id = f"cps_envs:{PROBLEMS[name].env_id(role)}"
    return find_subject(env_id, {"preset": preset, **settings.short, **options}, settings.variants.get(role, ()))


@pytest.mark.parametrize(("name", "preset", "role", "check"), list(cases()))
def test_conformance(name: str, preset: str, role: Role, check: Check) -> None:
    outcome = run_check(check, subject_of(name, preset, role))
    if outcome.status == "skipped":
        pytest.skip(outcome.reason)


def learned() -> Iterator[object]:
    """Every check of learners' interfaces; of a problem each is quick for one role."""
    for name, problem in PROBLEMS.items():
        for role in problem.training:
            for place, check in enumerate(check for check in LEARNING_CHECKS if check.__name__ not in ELSEWHERE):
                quick = is_quick(place, role) or len(problem.training) == 1
                yield pytest.param(name, role, check, marks=() if quick else (pytest.mark.slow,))


@pytest.mark.parametrize(("name", "role", "check"), list(learned()))
def test_the_interface_for_learners_conforms(name: str, role: Role, check: Check) -> None:
    outcome = run_check(check, subject_of(name, "learning", role, interface="learning"))
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


def moves(game: Game, seed: int) -> dict[Role, Array]:
    """A random action for each role, the same in all environments."""
    found: dict[Role, Array] = {}
    for role in ROLES:
        masks, actor = game.action_mask(role), Actor(game.action_space[role], game.neutral_action[role], seed, 1.0)
        found[role] = np.stack([actor.act(None if masks is None else masks.all(axis=0))] * game.num_envs)
    return found


def same(one: Any, other: Any) -> None:
    """Whether two games agree, and their states where the episodes go on."""
    np.testing.assert_array_equal(one.terminated, other.terminated)
    for name, values in one.state._asdict().items():
        theirs = getattr(other.state, name)
        np.testing.assert_array_equal(values[~one.terminated], theirs[~one.terminated], err_msg=name)
    for name, values in one.metrics().items():
        np.testing.assert_array_equal(values, other.metrics()[name], err_msg=name)


@pytest.mark.parametrize(("name", "preset"), PRESETS)
def test_steps_taken_at_once_are_steps_taken_one_by_one(name: str, preset: str) -> None:
    whole, parts = (started(PROBLEMS[name], (1, 2), preset, **settings_of(name).short) for _ in range(2))
    actions, envs, steps = moves(whole, 0), ALL, min(40, whole.horizon)
    paid = whole.advance(actions, envs, steps)
    assert paid == pytest.approx(sum(parts.advance(actions, envs, 1) for _ in range(steps)), abs=1e-9)
    same(whole, parts)


@pytest.mark.parametrize(("name", "preset"), PRESETS)
def test_a_model_goes_on_like_the_original(name: str, preset: str) -> None:
    game = started(PROBLEMS[name], (2, 3), preset, **settings_of(name).short)
    steps = game.horizon // 2
    game.advance(moves(game, 0), ALL, steps)
    before, copies = game.fingerprint(), game.model(1, 2)
    action = moves(game, 1)
    paid = copies.advance(action, ALL, steps)
    assert game.fingerprint() == before
    assert paid.tolist() == [game.advance(action, ALL, steps)[1]] * 2
    for mine, theirs in zip(game.parts(), copies.parts(), strict=True):
        np.testing.assert_array_equal(theirs, np.repeat(mine[1:], 2, axis=0))
    for role in ROLES:
        np.testing.assert_array_equal(copies.observe(role), np.repeat(game.observe(role)[1:], 2, axis=0))
