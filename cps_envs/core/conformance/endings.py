"""An episode ends once, by physics or by its clock, which is an end like any other; nothing happens outside."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded

from cps_envs.core.compute.generators import seeded
from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import BATCHES, difference, episode_steps, record
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.game.game import Game
from cps_envs.core.types import ROLES, BoolArray

EPISODES = 3


def check_endings(subject: Subject) -> None:
    """An episode terminates once, by physics or at its last game step, never later. Nothing truncates by itself."""
    game = subject.game()
    for role in ROLES:
        interval = game.decision_interval[role]
        message = f"the {role}'s decision interval {interval} has to divide the horizon of {game.horizon} game steps"
        assert game.horizon % interval == 0, message
    for seed in range(EPISODES):
        for boldness in (0.0, 0.7):
            for rival in ({}, {"opponent": "none"}):  # a good one may end every episode by physics
                _check_end(subject, seed, boldness, rival)


def _check_end(subject: Subject, seed: int, boldness: float, rival: Mapping[str, str]) -> None:
    """How one episode ends."""
    env = subject.single(**rival)
    results = record(env, seed=seed, boldness=boldness)[1][1:]
    for step, (_, _, terminated, truncated, _) in enumerate(results, start=1):
        where = f"at step {step} of {episode_steps(env)}, seed {seed}"
        kinds = {type(terminated), type(truncated)}
        assert kinds == {bool}, f"{where}: terminated and truncated have to be Python bools, not {kinds}"
        assert not truncated, f"{where}: truncated, though nobody has set a limit; the clock's end terminates"
    assert results[-1][2], f"seed {seed}: an episode goes on beyond its {episode_steps(env)} steps"


def check_reset_needed(subject: Subject) -> None:
    """`step` before the first `reset`, or after an episode has ended, raises gymnasium.error.ResetNeeded."""
    for name, make in subject.interfaces().items():
        actions, _ = record(make(), seed=61)
        _assert_refused(make(), actions[0], f"the {name} interface steps before the first reset")
        if not isinstance(env := make(), BATCHES):
            info: Any = env.reset(seed=61)[-1]
            crew = Crew(env, 61)
            for _ in actions:
                info = env.step(crew.act(info))[-1]
            _assert_refused(env, actions[0], f"the {name} interface steps on after the end of an episode")


def check_horizon(subject: Subject) -> None:
    """A game refuses to advance beyond its horizon, which its arrays may end at, and stays as it was.

    Raises:
        NotApplicableError: physics ends every episode before.
    """
    game, rival = subject.game(NUM_ENVS), np.arange(NUM_ENVS) > 0
    generators = seeded(range(NUM_ENVS))
    everyone = np.ones(NUM_ENVS, np.bool_)
    game.reset(everyone, generators)
    game.advance({}, everyone, game.horizon - 1)
    late = ~game.terminated
    if not late.any():
        raise NotApplicableError("physics ends every episode before the horizon")
    _assert_stays(game, late, 2)
    game.advance({}, late, 1)
    late &= ~game.terminated
    if late.any():
        _assert_stays(game, late, 1)
        game.reset(~rival, generators)  # one goes on while the others wait at their end
        game.advance({}, ~rival, game.horizon)
        if late[1:].any():
            _assert_stays(game, late & rival, 1)


def _assert_stays(game: Game, late: BoolArray, num_steps: int) -> None:
    """Whether a game that cannot go on says so before it touches anything."""
    before = _shown(game)
    try:
        game.advance({}, late, num_steps)
    except ResetNeeded:
        found = difference(_shown(game), before)
        assert found is None, f"an advance that was refused has changed something: {found}"
        return
    raise AssertionError(
        f"the game advances from step {game.elapsed.tolist()} by {num_steps}, beyond its horizon of {game.horizon}: "
        "it has to raise gymnasium.error.ResetNeeded"
    )


def _shown(game: Game) -> list[Any]:
    return [[game.observe(role) for role in ROLES], copy.deepcopy(game.metrics()), game.elapsed.copy()]


def _assert_refused(env: Any, action: Any, message: str) -> None:
    try:
        env.step(action)
    except ResetNeeded:
        return
    except Exception as error:
        raise AssertionError(f"{message} and meets {error!r}: it has to raise ResetNeeded") from error
    raise AssertionError(f"{message}: it has to raise gymnasium.error.ResetNeeded")
