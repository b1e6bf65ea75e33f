"""Adapters that belong to a controller: learning begins as it plays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import UnknownNameError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Role
from cps_envs.registration import find_problem, find_role, learning_env
from cps_envs.rogue.actions import LEVELS
from cps_envs.rogue.controllers import CONTROLLERS, FRONT, SLIDING
from cps_envs.rogue.reading import levels_of
from tests import episodes
from tests.settings import PROBLEM_TESTS

SEEDS = range(4)
BRIEF: Mapping[str, Any] = {  # the scale of inputs is measured by playing
    **{name: each.short for name, each in PROBLEM_TESTS.items()},
    "rogue": {"duration_s": 20.0},
    "disbanding": {"duration_s": 12.0},
}
TOGETHER = {"staggered": False}  # episodes that begin anywhere have to be played until there
EXACT: tuple[tuple[str, Role, str, object], ...] = (  # problem, role, controller, action that leaves it alone
    ("rogue", "attacker", "contested", 0.0),
    ("rogue", "defender", "monitor", 0),
    ("rogue", "defender", "guard", 0),
    ("fdi", "attacker", "task_tracker", 0.0),
    ("hvac", "defender", "bayes", 0.0),
)


@cache
def paid(problem: str, role: Role, policy: str) -> Array:
    """What the attacker is paid in a few episodes against the usual opponent, (B,)."""
    found = find_problem(problem)
    side: Role = "defender" if role == "attacker" else "attacker"
    players = {role: policy, side: found.opponents["learning"][side]}
    return play_episodes(found, found.config("learning", {}), players, SEEDS)["return"]


@pytest.mark.parametrize(("problem", "role", "controller", "action"), EXACT)
def test_the_neutral_action_is_the_controller(problem: str, role: Role, controller: str, action: object) -> None:
    left_alone = paid(problem, role, f"always?adapter={controller}&action={action}")
    np.testing.assert_array_equal(left_alone, paid(problem, role, controller))


@pytest.mark.parametrize(("problem", "role", "controller", "action"), EXACT)
def test_other_actions_are_other_decisions(problem: str, role: Role, controller: str, action: object) -> None:
    other = paid(problem, role, f"always?adapter={controller}&action=1")
    assert not np.array_equal(other, paid(problem, role, controller))


@pytest.mark.slow
def test_a_follower_around_string_is_paid_nearly_as_string_is() -> None:
    """It is about 0.2 points worse than the controller, of 14, where the plain follower is 2 worse."""
    near, plain = (paid("disbanding", "defender", f"always?adapter={name}&action=0") for name in ("string", "follow"))
    string = paid("disbanding", "defender", "string?detection_mps=0")
    assert abs(near.mean() - string.mean()) < 0.5 * abs(plain.mean() - string.mean())


@pytest.mark.parametrize(
    ("role", "adapter"),
    [
        ("RogueAttack", "contested"),
        ("RogueDefense", "monitor"),
        ("RogueDefense", "guard"),
        ("FdiAttack", "task_tracker"),
        ("HvacDefense", "bayes"),
        ("DisbandingDefense", "string"),
    ],
)
def test_learners_see_rows_within_bounds_that_the_policy_s_state_is_a_part_of(role: str, adapter: str) -> None:
    envs = learning_env(role, num_envs=2, adapter=adapter, frame_skip=5, **BRIEF[find_role(role)[0].name])
    envs.reset(options=TOGETHER)
    neutral = np.repeat(np.asarray(envs.adapter.neutral_action)[np.newaxis], envs.num_envs, axis=0)
    for _ in range(3):
        rows = envs.step(neutral)[0]
        assert np.isfinite(rows).all()
    seen = envs.outside.seen()
    state = envs.adapter.begin(envs.episodes)
    shown = envs.adapter.observe(seen, state)
    assert shown.shape == (envs.episodes, envs.agents, envs.adapter.fields.size)
    assert shown.dtype == np.float32
    assert (np.abs(shown) <= 1.0).all()


def test_a_policy_without_an_adapter_of_its_own_is_none() -> None:
    spec = episodes.spec_of(find_problem("rogue"), "defender", preset="learning")
    with pytest.raises(UnknownNameError, match="no adapter 'sliding'"):
        adapter_of(spec, "sliding")


def test_only_vehicles_near_a_suspect_may_depart_from_the_monitor() -> None:
    adapter = adapter_of(episodes.spec_of(find_problem("rogue"), "defender", preset="learning"), "monitor")
    envs = learning_env("RogueDefense", num_envs=2, adapter="monitor", **BRIEF["rogue"])
    envs.reset(options=TOGETHER)
    count, seen = len(adapter.agents), envs.outside.seen()
    nobody = adapter.begin(2)
    assert not adapter.active(seen, nobody).any()
    suspected = (nobody[0], np.array([2, -1]), *nobody[2:])
    active = adapter.active(seen, suspected)
    assert active[0, [0, 1, 3]].all()
    assert not active[0, 2]
    assert not active[1].any()
    chosen = np.full((2, count), 1)
    orders, _ = adapter.act(seen, nobody, chosen)
    advised, _ = adapter.act(seen, nobody, np.zeros_like(chosen))
    np.testing.assert_array_equal(orders, advised)


def test_vehicles_may_brake_or_drive_more_than_the_guard_says() -> None:
    adapter = adapter_of(episodes.spec_of(find_problem("rogue"), "defender", preset="learning"), "guard")
    envs = learning_env("RogueDefense", num_envs=1, adapter="guard", **BRIEF["rogue"])
    envs.reset(options=TOGETHER)
    first, seen, count = len(CONTROLLERS), envs.outside.seen(), len(adapter.agents)
    advice = np.resize([FRONT, first, first + 2, first + 4, first + 1], (1, count))
    left, brake, drive, follow, slide = (
        adapter.departures(seen, np.array([0]), advice, np.full_like(advice, action))[0].tolist() for action in range(5)
    )
    assert left == advice[0].tolist()
    assert brake[:5] == [first + 1, first, first + 1, first + 3, first]
    assert drive[:5] == [first + 3, first + 1, first + 3, first + 4, first + 2]
    assert (follow, slide) == ([FRONT] * count, [SLIDING] * count)


@pytest.mark.parametrize(
    ("behind_m", "suspect", "vehicle", "level"),
    [(-200.0, "leader", "rear", 0), (200.0, "rear", "leader", -1), (-200.0, "rear", "leader", 2)],
    ids=["ahead of its place", "behind its place", "pushed: where it is its place is open"],
)
def test_a_vehicle_drives_home_to_its_open_place(behind_m: float, suspect: str, vehicle: str, level: int) -> None:
    adapter = adapter_of(episodes.spec_of(find_problem("rogue"), "defender", preset="learning"), "guard")
    envs = learning_env("RogueDefense", num_envs=1, adapter="guard", frame_skip=5, **BRIEF["rogue"])
    envs.reset(options=TOGETHER)
    seen, count = envs.outside.seen(), len(adapter.agents)
    place = {"rear": 0, "leader": count - 1 - int((seen["present"] < 0.5).sum())}
    moved = Seen(seen.fields, seen.observation.copy(), team=seen.team)
    entry, (offset, scale) = seen.fields.offsets[0]["reference_error"], seen.fields.scale
    moved.observation[:, entry] = (behind_m - offset[entry]) / scale[entry]
    drive_home, advice = np.full((1, count), 5), np.full((1, count), FRONT)
    orders = adapter.departures(moved, np.array([place[suspect]]), advice, drive_home)
    assert orders[0, place[vehicle]] == len(CONTROLLERS) + level % len(LEVELS)


def test_a_vehicle_that_obeys_a_departure_is_not_suspected() -> None:
    """The monitor compares what a vehicle does with what it was ordered in the end, not with the advice."""
    adapter = adapter_of(episodes.spec_of(find_problem("rogue"), "defender", preset="learning"), "guard")
    envs = learning_env("RogueDefense", num_envs=1, adapter="guard", **BRIEF["rogue"])
    envs.reset(options=TOGETHER)
    count, first = len(adapter.agents), len(CONTROLLERS)
    state = list(adapter.begin(1))
    state[0][0, 1], state[1][0] = 5.0, 1
    orders, after = adapter.act(envs.outside.seen(), tuple(state), np.full((1, count), 1))
    named = np.where(orders[:, ::2] >= first, orders[:, ::2] - first, -1)
    told = np.where(np.isnan(after[3]), -1, np.abs(after[3][..., np.newaxis] - levels_of(envs.config)).argmin(axis=2))
    np.testing.assert_array_equal(told, named)
    assert (named >= 0).any()
