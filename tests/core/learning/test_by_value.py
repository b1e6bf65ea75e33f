"""The interface for learners against episodes that are computed by hand: rows, starts, averages, holds and pay."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.seeds import MOST_RUNS, training_seed
from cps_envs.core.declare.training import Training
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.learning import scaling
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.wiring import Wiring
from cps_envs.core.policies.team import Grouped
from tests.core.story import Story
from tests.core.tank import OPENED, PUMPS, TANK, Crew, TankGame

COUNT = 5
AVERAGED: dict[str, Any] = {"frame_skip": 3, "recent_s": (1.0, 4.0), "rough_s": 2.0}
SCALE = tuple(np.linspace(-0.3, 0.4, 8).tolist()), tuple(np.linspace(0.1, 0.8, 8).tolist())
TOLD: dict[str, Any] = {"mean": SCALE[0], "deviation": SCALE[1]}
HOLD = 6  # game steps of an action that is held for three decisions


def pumps(num_envs: int = COUNT, **options: Any) -> LearningVectorEnv:
    given = {"opponent": OPENED, "adapter": "pump", "scaling": SCALE, "copies": num_envs, **AVERAGED, **options}
    return LearningVectorEnv(TANK, "defender", num_envs, training=Training(), **given)


def stories(count: int = COUNT, first: int | None = None, same: bool = False, **options: Any) -> list[Story]:
    """Those of the episodes of run 0, or with these seeds."""
    start = training_seed(0) if first is None else first
    seeds = [start + (0 if same else b) for b in range(count)]
    return [Story(generator, **{**AVERAGED, **TOLD, **options}).start() for generator in seeded(seeds)]


def inputs(told: list[Story]) -> Any:
    return np.concatenate([each.inputs() for each in told])


def equal(found: Any, expected: Any) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("shared_pay", [False, True])
@pytest.mark.parametrize("settings", [AVERAGED, {"frame_skip": 4, "recent_s": (), "rough_s": 0.0}], ids=["avg", "raw"])
def test_rows_pay_and_ends_are_those_of_episodes_computed_by_hand(settings: Any, shared_pay: bool) -> None:
    """Episodes end at times of their own, and who goes on sees nothing of it: one look counts once."""
    width = 8 if settings is AVERAGED else 2
    scale = tuple(part[:width] for part in SCALE)
    env = pumps(shared_pay=shared_pay, scaling=scale, **settings)
    told = stories(same=True, mean=scale[0], deviation=scale[1], **settings)
    shown, _ = env.reset(seed=0)
    draws, apart = np.random.default_rng(1), 0
    returns, lengths = np.zeros(COUNT), np.zeros(COUNT, np.int64)
    for _ in range(30):
        equal(shown, inputs(told))
        np.testing.assert_array_equal(env.action_masks(), np.concatenate([each.masks() for each in told]))
        assert env.active().tolist() == [there for each in told for there in each.active()]
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        shown, rewards, ended, truncated, info = env.step(actions.ravel())
        own = np.array([each.step(mine) for each, mine in zip(told, actions, strict=True)])
        equal(rewards.reshape(COUNT, PUMPS), own.sum(axis=1, keepdims=True).repeat(PUMPS, 1) if shared_pay else own)
        returns, lengths = returns + own.sum(axis=1), lengths + 1
        over = np.array([each.over for each in told])
        assert ended.reshape(COUNT, PUMPS).all(axis=1).tolist() == over.tolist()
        assert not truncated.any()
        apart += bool(over.any() and not over.all())
        for b in np.flatnonzero(over):
            rows = slice(b * PUMPS, (b + 1) * PUMPS)
            equal(np.stack(info["final_obs"][rows]), told[b].inputs())
            final = info["final_info"]
            assert final["_episode"][rows].all()
            equal(final["episode"]["r"][rows], returns[b])
            assert final["episode"]["l"][rows].tolist() == [lengths[b]] * PUMPS
            equal(final["level_m"][rows], told[b].level)
            equal(final["rise"][rows], told[b].level - told[b].begun)
            returns[b], lengths[b] = 0.0, 0
            told[b].start()
        equal(info["energy"].reshape(COUNT, PUMPS)[:, 0], [each.energy for each in told])
    assert apart > 8


def test_one_row_for_a_team_is_its_agents_side_by_side() -> None:
    rows, joint, flat = pumps(), pumps(per_agent=False), pumps(per_agent=False, flat=True)
    shown = [env.reset(seed=0)[0] for env in (rows, joint, flat)]
    assert (joint.num_envs, joint.single_action_space.nvec.tolist(), flat.single_action_space.n) == (5, [3] * 4, 81)
    assert flat.neutral_action.tolist() == 40
    assert joint.neutral_action.tolist() == [1, 1, 1, 1]
    draws = np.random.default_rng(2)
    for _ in range(12):
        for found in shown[1:]:
            np.testing.assert_array_equal(found, shown[0].reshape(COUNT, -1))
        legal = joint.action_masks().reshape(COUNT, PUMPS, 3)
        for number in (0, 5, 44, 80):
            entries = np.unravel_index(number, (3,) * PUMPS)
            expected = legal[:, np.arange(PUMPS), entries].all(axis=1)
            assert flat.action_masks()[:, number].tolist() == expected.tolist()
        np.testing.assert_array_equal(joint.active(), rows.active().reshape(COUNT, PUMPS).any(axis=1))
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        one = rows.step(actions.ravel())
        two = joint.step(actions)
        three = flat.step(np.ravel_multi_index(tuple(actions.T), (3,) * PUMPS))
        shown = [one[0], two[0], three[0]]
        equal(two[1], one[1].reshape(COUNT, PUMPS).sum(axis=1))
        np.testing.assert_array_equal(three[1], two[1])


@pytest.mark.parametrize(("seed", "start"), [(0, 0), (0, 1), (3, 2)])
def test_starts_are_staggered_by_run_and_start_and_ended_episodes_start_again(seed: int, start: int) -> None:
    calm = pumps(64, copies=1, inflow=0.0, frame_skip=1, steps=24)  # nothing runs over: 12 decisions
    shown, info = calm.reset(seed=seed, options={"start": start})
    begins = np.random.default_rng(training_seed(seed) + start).integers(0, 12, 64)
    assert calm.game.elapsed.tolist() == ((11 - begins) * 2).tolist()
    first = training_seed(seed) + 64 * start  # of the episodes, which have begun once more
    levels = [
        (each.uniform(1, 3), each.uniform(0, 0), each.uniform(1, 3))[2] for each in seeded(range(first, first + 64))
    ]
    assert calm.game.start.tolist() == levels
    assert not calm._returns.any()
    assert not calm._lengths.any()
    assert shown.shape == (256, 8 + 3 + 3)
    equal(info["energy"].reshape(64, PUMPS)[:, 0], calm.game.energy)
    wild = pumps(64, copies=1, inflow=0.6, frame_skip=1)
    wild.reset(seed=seed, options={"start": start})
    assert not wild.game.terminated.any()
    assert wild.game.number.max() > 3  # some have run over on the way
    assert (wild.game.elapsed < 24).all()
    assert pumps(64, copies=1, frame_skip=2).reset() is not None  # of 6 decisions, too few


@pytest.mark.parametrize("options", [{"options": {"staggered": False}}, {}])
def test_starts_are_together_where_that_is_asked_for_or_episodes_are_short(options: Any) -> None:
    env = pumps(8, copies=1, frame_skip=1 if options else 2)
    shown, _ = env.reset(seed=0, **options)
    assert not env.game.elapsed.any()
    settings = {"frame_skip": 1 if options else 2}
    equal(shown, inputs(stories(8, **settings)))


def test_eight_decisions_are_enough_to_stagger() -> None:
    env = pumps(16, copies=1, frame_skip=1, steps=16)
    env.reset(seed=0)
    assert env.decisions == 8
    assert len(set(env.game.elapsed.tolist())) > 3


def test_a_power_of_the_pay_is_of_each_agent_and_episode_alone() -> None:
    env = pumps(pay_power=0.5)
    env.reset(seed=0)
    told, draws = stories(same=True), np.random.default_rng(4)
    paid = np.zeros((COUNT, PUMPS))
    ends = 0
    for _ in range(25):
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        learned = env.step(actions.ravel())[1].reshape(COUNT, PUMPS)
        own = np.array([each.step(mine) for each, mine in zip(told, actions, strict=True)])
        before, paid = np.maximum(-paid, 0), paid + own
        equal(learned, np.sqrt(1 + before) - np.sqrt(1 + np.maximum(-paid, 0)))
        for b, each in enumerate(told):
            if each.over:
                paid[b], ends = 0.0, ends + 1
                each.start()
    assert ends > 8


def test_another_payoff_than_the_game_s_own_is_paid_as_it_is() -> None:
    one, two = pumps(pay_power=0.5, payoff="wet"), pumps(payoff="wet")
    one.reset(seed=0), two.reset(seed=0)
    for _ in range(8):
        np.testing.assert_array_equal(one.step(np.zeros(20, np.int64))[1], two.step(np.zeros(20, np.int64))[1])


@pytest.mark.parametrize("per_agent", [True, False])
def test_relative_pay_is_over_neutral_pumps_in_the_same_episodes(per_agent: bool) -> None:
    """They rest for as long as an action is held, in an episode of their own that ends when it ends."""
    env = pumps(relative=True, per_agent=per_agent)
    env.reset(seed=0)
    told, rest, draws = stories(same=True), stories(same=True), np.random.default_rng(5)
    uneven = 0
    for _ in range(22):
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        found = env.step(actions.ravel() if per_agent else actions)[1]
        own = np.array([each.step(mine) for each, mine in zip(told, actions, strict=True)])
        less = np.array([np.zeros(PUMPS) if each.over else each.step([1] * PUMPS) for each in rest])
        expected = (own - less) if per_agent else (own - less).sum(axis=1)
        equal(found, expected.ravel())
        uneven += sum(one.over != two.over for one, two in zip(told, rest, strict=True))
        for b, each in enumerate(told):
            if each.over:
                each.start()
                rest[b].start()
    assert uneven > 5


def test_an_episode_that_starts_a_step_later_is_neither_played_nor_paid_in_that_step() -> None:
    env = pumps(relative=True, autoreset="next_step")
    shown, _ = env.reset(seed=0)
    told, rest, draws = stories(same=True), stories(same=True), np.random.default_rng(8)
    for _ in range(22):
        equal(shown, inputs(told))
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        own = np.zeros((COUNT, PUMPS))
        for b, (one, two) in enumerate(zip(told, rest, strict=True)):
            if one.over:
                one.start(), two.start()
                continue
            own[b] = one.step(actions[b]) - (0.0 if two.over else two.step([1] * PUMPS))
        shown, rewards, ended, *_ = env.step(actions.ravel())
        equal(rewards, own.ravel())
        assert ended.reshape(COUNT, PUMPS)[:, 0].tolist() == [each.over for each in told]


def test_a_native_role_is_paid_by_its_sign_in_each_episode_that_goes_on() -> None:
    for role, sign in (("attacker", 1.0), ("defender", -1.0)):
        kind = type("Made", (RoleVectorEnv,), {"problem": TANK, "role": role})
        other_one = OPENED if role == "defender" else "none"
        env = kind(3, interface="native", opponent=other_one, inflow=(0.1, 0.3), autoreset="disabled", frame_skip=2)
        env.reset(seed=1)
        start = env.game.level.copy()
        action = np.ones((3, PUMPS) if role == "defender" else 3, np.int64)
        rewards = env.step(action)[1]
        equal(rewards, sign * (env.game.level - start))
        assert np.abs(rewards).min() > 0.3


def test_inputs_end_where_their_space_does() -> None:
    env = pumps(scaling=((0.5,) * 8, (1e-4,) * 8))
    shown, _ = env.reset(seed=0)
    space = env.single_observation_space
    assert (set(space.low.tolist()), set(space.high.tolist())) == ({-5.0}, {5.0})
    assert set(shown[:, :8].ravel().tolist()) == {-5.0}
    assert env.observation_space.contains(shown)
    assert space.local  # by sensors of its own
    assert (space.agents, pumps(per_agent=False).single_observation_space.agents) == (1, PUMPS)


def test_the_attacker_decides_when_the_level_has_passed_a_metre_or_its_action_has_been_held() -> None:
    scale = ((0.0, 0.0), (1.0, 1.0))
    valve = Training(adapter="valve", frame_skip=3)
    env = LearningVectorEnv(TANK, "attacker", 2, training=valve, copies=2, scaling=scale, inflow=(0.05, 0.2), steps=300)
    env.reset(seed=0)
    assert env.waits
    levels, held = env.game.level.copy(), []
    for _ in range(12):
        before, lengths = env.game.elapsed.copy(), []
        rewards = env.step(np.array([1, 1]))[1]
        if (env.game.elapsed < before).any():
            levels = env.game.level.copy()
            continue
        for b in range(2):
            decisions, level = 0, levels[b]
            while decisions == 0 or (decisions < 3 and np.floor(level) == np.floor(levels[b])):
                level, decisions = level + 3 * env.game.inflow[b], decisions + 1
            lengths.append(3 * decisions)
            equal(rewards[b], level - levels[b])
        assert (env.game.elapsed - before).tolist() == lengths
        levels, held = env.game.level.copy(), held + lengths
    assert set(held) == {3, 6, 9}


def test_a_swarm_meets_the_same_episodes() -> None:
    given = {"interface": "learning", "opponent": OPENED, "scaling": {"defender": SCALE}, **AVERAGED}
    env = SwarmVectorEnv(TANK, "defender", COUNT, **given)
    told = stories(first=3)
    shown, infos = env.reset(seed=3)
    draws, ends = np.random.default_rng(6), 0
    for _ in range(20):
        for pump, name in enumerate(env.possible_agents):
            equal(shown[name], np.stack([each.inputs()[pump] for each in told]))
            np.testing.assert_array_equal(infos[name]["action_mask"], [each.masks()[pump] for each in told])
            assert infos[name]["due"].all()
        actions = draws.integers(0, 3, (COUNT, PUMPS))
        given = dict(zip(env.possible_agents, actions.T, strict=True))
        shown, rewards, terminated, truncated, infos = env.step(given)
        own = np.array([each.step(mine) for each, mine in zip(told, actions, strict=True)])
        equal(np.stack([rewards[name] for name in env.possible_agents], axis=1), own)
        assert terminated["pump_0"].tolist() == [each.over for each in told]
        assert not truncated["pump_3"].any()
        for each in told:
            if each.over:
                each.start()
                ends += 1
    assert ends > 8


def test_a_batch_that_starts_some_episodes_again_leaves_the_others_alone() -> None:
    env = RoleVectorEnvOfPumps(COUNT, autoreset="disabled", steps=600, inflow=0.0, **AVERAGED)
    told = stories(first=8, steps=600)
    shown, _ = env.reset(seed=8)
    for each in told:
        each.inflow = 0.0
    draws = np.random.default_rng(7)
    for step in range(9):
        equal(shown, inputs(told))
        if step % 3 == 2:
            mask = draws.random(COUNT) < 0.5
            shown, _ = env.reset(options={"reset_mask": mask})
            for b in np.flatnonzero(mask):
                told[b].start().inflow = 0.0
            equal(shown, inputs(told))
        actions = draws.integers(0, 2, (COUNT, PUMPS))  # nothing runs over
        shown = env.step(actions.ravel())[0]
        for each, mine in zip(told, actions, strict=True):
            each.step(mine)


class RoleVectorEnvOfPumps(RoleVectorEnv):
    problem, role = TANK, "defender"

    def __init__(self, num_envs: int, **options: Any) -> None:
        given = {"interface": "learning", "adapter": "pump", "scaling": SCALE, "per_agent": True, **options}
        super().__init__(num_envs, opponent=OPENED, **given)


def test_one_number_may_stand_for_all_entries_of_a_native_action() -> None:
    given: dict[str, Any] = {"interface": "native", "adapter": None, "scaling": None, "per_agent": False}
    flat, usual = (RoleVectorEnvOfPumps(2, flat=each, frame_skip=2, **given) for each in (True, False))
    np.testing.assert_array_equal(flat.reset(seed=0)[0], usual.reset(seed=0)[0])
    assert flat.single_action_space == spaces.Discrete(81)
    assert flat.neutral_action.tolist() == 40
    assert usual.neutral_action.tolist() == [1, 1, 1, 1]
    for number in (0, 40, 77):
        entries = np.unravel_index(number, (3,) * PUMPS)
        legal = usual.action_masks().reshape(2, PUMPS, 3)[:, np.arange(PUMPS), entries].all(axis=1)
        assert flat.action_masks()[:, number].tolist() == legal.tolist()
        one, two = flat.step(np.array([number, 40])), usual.step(np.array([entries, [1] * PUMPS]))
        np.testing.assert_array_equal(one[0], two[0])
        np.testing.assert_array_equal(one[1], two[1])
        assert flat.game.elapsed.tolist() == usual.game.elapsed.tolist()


def test_groups_are_paid_the_sum_and_told_the_mean_of_their_members() -> None:
    game = TankGame(TANK.presets["learning"], 2)
    game.own[:], game.inflow[:] = [[1, 2, 4, 8], [16, 32, 64, 128]], [1.0, 3.0]
    team = Grouped(Crew(game), ("left", "right"))
    assert team.rewards(np.zeros(2)).tolist() == [[-3, -12], [-48, -192]]
    assert team.privileged().tolist() == [[[1, 0.5], [1, 2.5]], [[3, 1.5], [3, 7.5]]]
    env = LearningVectorEnv(TANK, "defender", 2, training=Training(adapter="pair"), copies=2, scaling=((0.0,), (1.0,)))
    env.reset(seed=0)
    inflow = env.game.inflow
    assert env.privileged_size == 2
    equal(env.privileged(), [[f, k * f] for f in inflow for k in (0.5, 2.5)])
    start = env.game.level.copy()
    rewards = env.step(np.array([[1.0], [0.0]] * 2))[1].reshape(2, 2)
    equal(env.game.level - start, 2 * (inflow + 0.2))
    half = (env.game.level - start) / 2
    equal(rewards, np.stack([-half - 2 * 0.01 * (1 + 2), -half], axis=1))


def test_one_agent_is_told_what_its_role_is() -> None:
    env = LearningVectorEnv(
        TANK, "attacker", 3, training=Training(adapter="valve"), copies=3, scaling=((0.0,) * 2, (1.0,) * 2)
    )
    env.reset(seed=0)
    assert env.privileged_size == 2
    equal(env.privileged(), np.stack([env.game.inflow, env.game.inflow**2], axis=1))
    assert env.active().tolist() == [True] * 3
    outside = Outside(env.game, "attacker", "valve")
    assert outside.rewards(np.array([1.0, 2.0, 3.0])).tolist() == [[1.0], [2.0], [3.0]]
    assert Outside(env.game, "defender", "native").rewards(np.array([1.0, 2.0, 3.0])).tolist() == [
        [-1.0],
        [-2.0],
        [-3.0],
    ]


@pytest.mark.parametrize("most", [10**6, 100])
def test_the_scale_is_of_what_active_agents_meet_under_random_legal_actions(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scaling, "EPISODES", 12)
    monkeypatch.setattr(scaling, "MOST_SAMPLES", most)
    wiring = Wiring("tank", "defender", "pump", masked=True, frame_skip=1, recent_s=(1.0, 4.0), rough_s=2.0)
    found = scaling.measure(TANK, TANK.presets["learning"], "learning", wiring)
    first = training_seed(MOST_RUNS - 1)
    assert first == scaling.SEED
    told = stories(12, first=first, frame_skip=1, mean=0.0, deviation=1.0)
    draws = np.random.default_rng(first)
    begins, met = draws.integers(0, 12, 12), []
    for decision in range(12):
        met += [row for each in told for row, there in zip(each.inputs()[:, :8], each.active(), strict=True) if there]
        chances = draws.random((12 * PUMPS, 3))
        legal = np.concatenate([each.masks() for each in told])
        actions = np.where(legal, chances, -1.0).argmax(axis=1).reshape(12, PUMPS)
        for b, each in enumerate(told):
            each.step(actions[b])
            if each.over or begins[b] == decision:
                each.start()
    table = np.array(met)
    assert len(table) > 300
    kept = table[:: len(table) // most + 1]
    np.testing.assert_allclose(found[0], kept.mean(axis=0), rtol=2e-5, atol=2e-5)
    np.testing.assert_allclose(found[1], np.maximum(kept.std(axis=0), 0.02), rtol=2e-5, atol=2e-5)
    assert 0.02 in found[1]  # the mean change of a level is hardly any
    assert all(float(f"{value:.5g}") == value for part in found for value in part)
