"""Games of the HVAC problem that have begun, and how the tests move them."""

from __future__ import annotations

import numpy as np

from cps_envs.core.lookup import resolve_policy
from cps_envs.core.match import Match
from cps_envs.core.play import play_episodes
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC

SHORT = {"num_steps": 90, "window_steps": 40, "onset_step": 45}
QUIET = {"noise_std_c": 0.0}


def started(seeds=(0,), preset="paper", **overrides):
    game = HvacGame(HVAC.config(preset, overrides), len(seeds))
    game.reset(np.ones(len(seeds), bool), [np.random.default_rng(seed) for seed in seeds])
    return game


def go(game, choice=0, attack=None, num_steps=1):
    actions = {"defender": np.full(game.num_envs, choice)}
    if attack is not None:
        actions["attacker"] = np.broadcast_to(attack, (game.num_envs, game.action_space["attacker"].shape[0])).copy()
    return game.advance(actions, np.ones(game.num_envs, bool), num_steps)


def seen(game, role):
    return game.fields[role].decode(game.observe(role))


def play(attacker, defender, seeds=range(10), preset="paper", on_step=None, **overrides):
    players = {"attacker": attacker, "defender": defender}
    return play_episodes(HVAC, HVAC.config(preset, overrides), players, seeds, on_step=on_step)


def spec_of(role, preset="learning", **overrides):
    return HvacGame(HVAC.config(preset, overrides), 1).spec(role)


def watched(attacker, defender, seeds, on_step, **overrides):
    """Play with objects, so that `on_step` can look at game and match."""
    game = HvacGame(HVAC.config("learning", overrides), len(seeds))
    match = Match(game, {"attacker": resolve_policy(attacker, game.spec("attacker")),
                         "defender": resolve_policy(defender, game.spec("defender"))})  # fmt: skip
    everybody = np.ones(len(seeds), bool)
    match.reset(everybody, [np.random.default_rng(seed) for seed in seeds])
    for _ in range(game.horizon):
        match.step({}, everybody, 1)
        on_step(game)
    return game
