"""The vector environment for learners: rows, rewards, ends, seeds, and that its wiring plays the same elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

import cps_envs
from cps_envs.core.declare.seeds import TRAINING_START, training_seed
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import Role
from cps_envs.rogue.problem import ROGUE
from tests.core.toy import TOY, ToyAttackVectorEnv, ToyDefenseVectorEnv

QUIET: dict[str, Any] = {"opponent": "none", "reach_m": 0.0}


def defense(num_envs: int = 4, **options: Any) -> LearningVectorEnv:
    return LearningVectorEnv(TOY, "defender", num_envs, adapter="axis", **{**QUIET, **options})


def attack(num_envs: int = 4, **options: Any) -> LearningVectorEnv:
    return LearningVectorEnv(TOY, "attacker", num_envs, **{**QUIET, **options})


def run(envs: Any, steps: int, seed: int = 0) -> list[tuple[Any, ...]]:
    generator = np.random.default_rng(seed)
    results = [envs.reset(seed=seed)]
    for _ in range(steps):
        shape = envs.action_space.shape
        nvec = getattr(envs.action_space, "nvec", None)
        action = generator.uniform(-1, 1, shape) if nvec is None else generator.integers(0, nvec)
        results.append(envs.step(action))
    return results


def test_there_is_a_row_for_each_agent_of_each_episode() -> None:
    envs = defense(3, recent_s=(2.0, 5.0))
    rows, _ = envs.reset(seed=0)
    columns = envs.single_observation_space.columns
    assert (columns.scaled, columns.last_action, columns.mask) == (2 * 3, 1, 0)
    assert rows.shape == (6, columns.size) == envs.observation_space.shape
    assert rows.dtype == np.float32
    assert envs.num_envs == 6
    assert envs.action_space.shape == (6, 1)


def test_agents_are_paid_their_parts_of_the_role_s_reward() -> None:
    envs = defense(5, frame_skip=2)  # decisions so few that starts are not staggered
    envs.reset(seed=1)
    together = ToyDefenseVectorEnv(5, preset="learning", autoreset=AutoresetMode.DISABLED, frame_skip=2, **QUIET)
    together.reset(seed=[training_seed(1) + b for b in range(5)])
    for _ in range(6):
        actions = np.random.default_rng(3).uniform(-1, 1, (5, 2))
        _, reward, terminated, *_ = envs.step(actions.reshape(10, 1))
        _, expected, ended, *_ = together.step(actions)
        np.testing.assert_allclose(reward.reshape(5, 2).sum(axis=1), expected, rtol=1e-12)
        np.testing.assert_array_equal(terminated.reshape(5, 2), ended[:, np.newaxis].repeat(2, axis=1))


def test_nothing_is_truncated_and_the_end_tells_return_and_length() -> None:
    results = run(defense(4), 30)[1:]
    assert not any(truncated.any() for _, _, _, truncated, _ in results)
    paid = np.zeros(8)
    first = np.ones(8, np.bool_)
    seen = 0
    for _, reward, ended, _, info in results:
        paid += reward
        for row in np.flatnonzero(ended):
            episode = info["final_info"]["episode"]
            assert episode["l"][row] <= 12
            if not first[row]:
                both = paid.reshape(4, 2)[row // 2].sum()
                assert episode["r"][row] == pytest.approx(both)
                assert episode["l"][row] == 12
                seen += 1
            assert info["final_obs"][row].shape == (3,)
        paid[ended], first[ended] = 0.0, False
    assert seen > 4


def test_starts_are_staggered() -> None:
    envs = defense(64)
    envs.reset(seed=0)
    assert len(set(envs.game.elapsed.tolist())) > 6


def test_a_seed_numbers_training_runs_far_from_evaluations() -> None:
    one, two = run(attack(), 10), run(attack(), 10)
    for (mine, *_), (theirs, *_) in zip(one, two, strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert any((mine[0] != other[0]).any() for mine, other in zip(one, run(attack(), 10, seed=1), strict=True))
    assert training_seed(0) == TRAINING_START
    with pytest.raises(ConfigurationError, match="numbers a training run"):
        attack().reset(seed=9_000)


def test_actions_are_held_and_the_last_one_is_shown() -> None:
    envs = attack(2, frame_skip=2)
    envs.reset(seed=0)
    before = envs.game.elapsed.copy()
    rows, *_ = envs.step(np.array([3, 1]))
    columns = envs.single_observation_space.columns
    last = rows[:, columns.scaled : columns.scaled + columns.last_action]
    live = envs.game.elapsed > before
    np.testing.assert_array_equal(last[live].argmax(axis=1), np.array([3, 1])[live])
    assert (envs.game.elapsed - before)[live].tolist() == [6] * live.sum()


def test_masks_are_the_last_columns() -> None:
    envs = attack(3)
    rows, _ = envs.reset(seed=0)
    np.testing.assert_array_equal(rows[:, -5:] > 0, envs.action_masks())
    np.testing.assert_array_equal(envs.action_masks(), envs.game.action_mask("attacker"))
    with pytest.raises(AttributeError, match="no action masks"):
        defense().action_masks()


def test_inputs_are_scaled_once_by_what_an_untrained_policy_meets() -> None:
    envs = defense(64)
    rows = np.concatenate([result[0] for result in run(envs, 40)])[:, :2]
    assert np.abs(rows.mean(axis=0)).max() < 0.5
    assert 0.5 < rows.std(axis=0).min() < rows.std(axis=0).max() < 2
    wiring = envs.single_observation_space.wiring
    again = defense(64, scaling=(wiring.mean, wiring.deviation))
    assert again.single_observation_space.wiring == wiring


def test_a_power_of_the_pay_adds_up_to_that_power() -> None:
    envs, plain = attack(2, pay_power=0.5), attack(2)
    total, paid = np.zeros(2), np.zeros(2)
    for each in (envs, plain):
        each.reset(seed=2)
    for _ in range(4):
        learned, reward = envs.step(np.array([1, 2]))[1], plain.step(np.array([1, 2]))[1]
        total, paid = total + learned, paid + reward
    np.testing.assert_allclose(total, np.sqrt(1 + paid) - 1)


def test_copies_of_an_episode_are_the_same_until_their_actions_differ() -> None:
    envs = attack(4, copies=2)
    envs.reset(seed=0)
    np.testing.assert_array_equal(envs.game.intruder[:2], envs.game.intruder[2:])
    with pytest.raises(ConfigurationError, match="a multiple of copies = 2"):
        attack(3, copies=2)


def test_nonsense_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"no adapter 'axes'\. Did you mean 'axis'"):
        LearningVectorEnv(TOY, "defender", 2, adapter="axes")
    with pytest.raises(ConfigurationError, match="frame_skip = 0"):
        attack(frame_skip=0)
    with pytest.raises(ConfigurationError, match="recent_s"):
        attack(recent_s=(0.0,))
    with pytest.raises(ConfigurationError, match="num_envs"):
        attack(0)
    for seed in (-1, "zero", True, [None]):
        with pytest.raises(ConfigurationError, match=r"seed = .* must be a whole number from 0 on"):
            attack().reset(seed=seed)  # type: ignore[arg-type]
    with pytest.raises(ResetNeeded):
        attack().step(np.zeros(4, np.int64))
    envs = attack()
    envs.reset()
    with pytest.raises(ValueError, match="shape"):
        envs.step(np.zeros(3, np.int64))
    with pytest.raises(ValueError, match="whole number"):
        envs.step(np.array([0, 1, 2, 5]))


def test_roles_are_found_by_short_names_and_ids() -> None:
    for name in ("toys/ToyAttack-v0", "tests.core.toy:toys/ToyAttack-v0"):
        assert cps_envs.learning_env(name, 2).problem is TOY
    with pytest.raises(UnknownNameError, match=r"no role 'RougeAttack'\. Did you mean 'RogueAttack'"):
        cps_envs.learning_env("RougeAttack", 2)
    assert cps_envs.learning_env("FdiAttack", 2, adapter="native", horizon=40).role == "attacker"


def test_learners_meet_whom_their_settings_name_in_preset_learning_alone() -> None:
    def opponent(role: Role, **options: Any) -> Any:
        return LearningVectorEnv(ROGUE, role, 1, scaling=((), ()), **options).opponent

    usual, told = ROGUE.opponents, ROGUE.training["defender"].opponent
    assert opponent("defender") == told != usual["learning"]["attacker"]
    assert opponent("defender", opponent="square") == "square"
    assert opponent("defender", preset="easy", adapter="vehicle") == usual["easy"]["attacker"]
    assert opponent("attacker", preset="easy", adapter="native") == usual["easy"]["defender"]


def test_the_native_adapter_shows_what_the_role_sees() -> None:
    envs = attack(3, scaling=((), ()))
    envs.reset(seed=4)
    batch = ToyAttackVectorEnv(3, preset="learning", **QUIET)
    shown, _ = batch.reset(seed=[training_seed(4) + b for b in range(3)])
    np.testing.assert_array_equal(envs._side.observe()[:, : shown.shape[1]], shown)
