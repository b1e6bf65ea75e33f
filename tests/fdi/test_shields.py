"""Shields: what they forbid, what they promise, and the two ways to use them."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_baselines.fdi.continuation import legal_continuation
from cps_baselines.fdi.shield_policy import Shielded
from cps_baselines.fdi.shields import LpShield, ShieldedInjection, SoundShield, make_shield
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.problem import FDI
from tests.fdi.episodes import play, spec_of, task_settings

DEAD_END = "x2,3>1"  # the mask alone lets about 2 % of these episodes end illegally
STICKY = "random?extremes=true&stickiness=0.8"


def shielded(kind: str, policy: str = STICKY) -> str:
    return f'shielded?policy="{policy.replace("&", "%26")}"&kind={kind}'


def environment(kind: str | None = None, **overrides: Any) -> ShieldedInjection:
    env = gymnasium.make("cps_envs:cps_envs/FdiAttack-v0", **{"preset": "paper", **overrides})
    return env if kind is None else ShieldedInjection(env, kind)


def state_before_a_dead_end() -> tuple[FdiConfig, Array, int, Array]:
    """A legal move (error, step, levels) after which the LP has no legal continuation, from masked episodes."""
    config = FDI.config("paper", task_settings(DEAD_END))
    game, generator = FDI.game(config, 1), np.random.default_rng(0)
    shield, episode = LpShield(config), np.ones(1, np.bool_)
    for _ in range(300):
        game.reset(episode, [generator])
        side = generator.integers(0, 2, 2)
        while not game.terminated[0] and game.elapsed[0] < game.horizon:
            side = np.where(generator.random(2) < 0.8, side, generator.integers(0, 2, 2))
            error, step = game.episode(0).error.copy(), int(game.elapsed[0])
            wish = game.state.legal[0][np.arange(2), side]
            levels = shield._legal(config.fixed_task, error, wish[np.newaxis])[0]
            after = shield.form.error_after(error, levels)
            if not shield._over(after) and not legal_continuation(config, config.fixed_task, after, step + 1):
                return config, error, step, levels
            game.advance({"attacker": (levels + 100)[np.newaxis]}, episode, 1)
    raise AssertionError("no dead end was met")


def test_the_mask_alone_meets_dead_ends() -> None:
    assert play(STICKY, seeds=range(600), **task_settings(DEAD_END))["illegal"].mean() > 0


@pytest.mark.parametrize("shield_class", [LpShield, SoundShield])
def test_a_move_into_a_dead_end_is_replaced(shield_class: type[Any]) -> None:
    config, error, step, levels = state_before_a_dead_end()
    shield = shield_class(config)
    allowed, _ = shield.allow(config.fixed_task, error, step, levels, np.zeros((0, 2), np.int64))
    assert not np.array_equal(allowed, levels)
    after = shield.form.error_after(error, allowed)
    assert shield._over(after) or legal_continuation(config, config.fixed_task, after, step + 1)


def test_the_lp_shield_takes_the_nearest_levels() -> None:
    config, error, step, levels = state_before_a_dead_end()
    shield = LpShield(config)
    allowed, _ = shield.allow(config.fixed_task, error, step, levels, np.zeros((0, 2), np.int64))
    reach = int(np.abs(allowed - levels).sum())
    for first in range(-reach, reach + 1):
        for second in range(-reach, reach + 1):
            if abs(first) + abs(second) >= reach:
                continue
            other = levels + np.array([first, second])
            legal = shield._legal(config.fixed_task, error, other[np.newaxis])[0]
            after = shield.form.error_after(error, legal)
            if np.array_equal(legal, other):
                assert not shield._over(after)
                assert not legal_continuation(config, config.fixed_task, after, step + 1)


@pytest.mark.parametrize(("kind", "episodes"), [("lp", 60), ("sound", 12)])
def test_no_shielded_episode_ends_illegally(kind: str, episodes: int) -> None:
    outcome = play(shielded(kind), seeds=range(episodes), **task_settings(DEAD_END))
    assert outcome["illegal"].max() == 0


@pytest.mark.parametrize("kind", ["lp", "sound"])
def test_a_shield_lets_the_optimum_pass(kind: str) -> None:
    outcome = play(shielded(kind, "oracle"), **task_settings("x4>4"))
    assert outcome["return"][0] == pytest.approx(outcome["oracle_value_mps"][0], abs=1e-4)


@pytest.mark.parametrize("kind", ["lp", "sound"])
def test_the_wrapper_plays_wild_actions_legally(kind: str) -> None:
    env = environment(kind, attacked="xv4", target=4)
    generator, replaced = np.random.default_rng(0), []
    for seed in range(3):
        env.reset(seed=seed)
        while True:
            *_, terminated, truncated, info = env.step(generator.integers(env.action_space.nvec))
            replaced.append(info["shielded"])
            if terminated or truncated:
                break
        assert info["illegal"] == 0
    assert np.mean(replaced) > 0.5


def test_wrapper_and_policy_agree() -> None:
    spec, settings = spec_of("attacker", attacked="v4"), {"attacked": "v4"}
    env, generator = environment("lp", **settings), np.random.default_rng(3)

    class Fixed:
        def __init__(self) -> None:
            self.actions = generator.integers(0, 81, (20, 1))

        def predict(
            self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
        ) -> Any:
            step = round(20 - float(spec.fields.decode(observation)["steps_left"][0]))
            return self.actions[step][np.newaxis], state

    fixed = Fixed()
    outcome = play(Shielded(spec, fixed, "lp"), **settings)
    env.reset(seed=0)
    rewards = []
    for action in fixed.actions:
        _, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        if terminated or truncated:
            break
    assert sum(rewards) == outcome["return"][0]
    assert info["injected_share"] == outcome["injected_share"][0]


def test_shields_work_on_shares_and_drawn_tasks() -> None:
    outcome = play(shielded("lp", "random"), seeds=range(4), tasks="x1>1 xv4>4", attack_action="share")
    assert outcome["illegal"].max() == 0
    env = environment("lp", tasks="x1>1 v1,4>4", attack_action="share")
    env.reset(seed=0)
    assert env.step(np.full(8, 21))[4]["illegal"] == 0


def test_shields_say_where_they_do_not_belong() -> None:
    with pytest.raises(ConfigurationError, match="sound"):
        make_shield("sond", FDI.config("paper", {}))
    with pytest.raises(ConfigurationError, match='limits="hard"'):
        make_shield("lp", FDI.config("clip", {}))
    with pytest.raises(ConfigurationError, match="FdiAttack"):
        ShieldedInjection(gymnasium.make("cps_envs:cps_envs/FdiDefense-v0"))
