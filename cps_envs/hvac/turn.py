"""A turn of the game in one kernel call: both moves, the physics, and what everybody may know afterwards.

A call costs by the arrays that it is passed, some 5 microseconds for all of them; hence one call and not five. They are
passed as plain tuples, for which numba takes half the time that it takes for the named ones.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cps_envs.core.kernels import inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.attack import sense
from cps_envs.hvac.estimation import choose, estimate
from cps_envs.hvac.metrics import attacked_states, count_choice, count_errors, measure
from cps_envs.hvac.model import Model
from cps_envs.hvac.observation import observe_attacker, observe_defender
from cps_envs.hvac.plant import heat, move
from cps_envs.hvac.state import State, episode_of

Values: TypeAlias = tuple[Any, ...]  # of a named tuple, without their names


class Account(NamedTuple):
    """What is known after a turn."""

    payoff: FloatArray  # (B,) of the attacker in the last turn
    metrics: FloatArray  # (B, len(METRICS))
    attacker: FloatArray  # (B, size) what the attacker observes, in units
    defender: FloatArray  # (B, size) what the defender observes, in units


@kernel
def begin(model_values: Values, state_values: Values, account_values: Values, envs: BoolArray) -> None:
    """Read the sensors of k = 0, which nobody has forged, in the marked environments (B,)."""
    model, state, account = Model(*model_values), State(*state_values), Account(*account_values)
    quiet = np.zeros(len(model.zone) + 1)
    for b in range(len(envs)):
        if envs[b]:
            episode = episode_of(state, b)
            count_errors(model, episode)
            sense(model, episode, quiet)
            estimate(model, episode)
            report(model, episode, account, b)


@kernel
def take_turn(
    model_values: Values,
    state_values: Values,
    account_values: Values,
    forging: FloatArray,
    choices: IntArray,
    envs: BoolArray,
    num_steps: int,
) -> None:
    """Take `num_steps` steps in the marked environments (B,).

    The defender's `choices` (B,) answer the readings of k; the attacker's actions `forging` (B, S + 1) or (B, S) make
    those of k + 1. In the first step the attacker is paid for x(0) too, if the attack counts from there.
    """
    model, state, account = Model(*model_values), State(*state_values), Account(*account_values)
    for b in range(len(envs)):
        account.payoff[b] = 0.0
        if envs[b]:
            episode = episode_of(state, b)
            if episode.step[0] == 0:
                account.payoff[b] = episode.squared_error[0] / attacked_states(model, episode)
            for _ in range(num_steps):
                xh, change = choose(model, episode, choices[b])
                count_choice(model, episode)
                heat(model, episode, xh, change)
                move(model, episode)
                account.payoff[b] += count_errors(model, episode)
                sense(model, episode, forging[b])
                estimate(model, episode)
            report(model, episode, account, b)


@inlined
def report(model: Model, episode: State, account: Account, b: int) -> None:
    """Bring the account of an episode up to its state."""
    measure(model, episode, account.metrics[b])
    loop = observe_defender(model, episode, account.defender[b])
    observe_attacker(model, episode, account.defender[b, :loop], account.attacker[b])
