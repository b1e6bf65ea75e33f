"""A turn of the game in one kernel call: both moves, the physics, and what everybody may know afterwards.

A call costs by the arrays that it is passed, some 5 microseconds for all of them; hence one call and not five. They are
passed as plain tuples, for which numba takes half the time that it takes for the named ones.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cps_envs.core.compiled import inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.attack import sense
from cps_envs.hvac.estimation import choose, estimate
from cps_envs.hvac.metrics import attacked_states, count_choice, count_errors, measure
from cps_envs.hvac.model import Model
from cps_envs.hvac.observation import observe_attacker, observe_defender
from cps_envs.hvac.plant import heat, move
from cps_envs.hvac.state import State, lane_of

Values: TypeAlias = tuple[Any, ...]  # of a named tuple, without their names


class Account(NamedTuple):
    """What is known after a turn."""

    payoff: FloatArray  # (B,) of the attacker in the last turn
    metrics: FloatArray  # (B, len(METRICS))
    attacker: FloatArray  # (B, size) what the attacker observes, in units
    defender: FloatArray  # (B, size) what the defender observes, in units


@kernel
def begin(model_values: Values, state_values: Values, account_values: Values, lanes: BoolArray) -> None:
    """Read the sensors of k = 0, which nobody has forged, in the marked lanes (B,)."""
    model, state, account = Model(*model_values), State(*state_values), Account(*account_values)
    quiet = np.zeros(len(model.zone) + 1)
    for b in range(len(lanes)):
        if lanes[b]:
            lane = lane_of(state, b)
            count_errors(model, lane)
            sense(model, lane, quiet)
            estimate(model, lane)
            report(model, lane, account, b)


@kernel
def take_turn(
    model_values: Values,
    state_values: Values,
    account_values: Values,
    forging: FloatArray,
    choices: IntArray,
    lanes: BoolArray,
    num_steps: int,
) -> None:
    """Take `num_steps` steps in the marked lanes (B,).

    The defender's `choices` (B,) answer the readings of k; the attacker's actions `forging` (B, S + 1) or (B, S) make
    those of k + 1. In the first step the attacker is paid for x(0) too, if the attack counts from there.
    """
    model, state, account = Model(*model_values), State(*state_values), Account(*account_values)
    for b in range(len(lanes)):
        account.payoff[b] = 0.0
        if lanes[b]:
            lane = lane_of(state, b)
            if lane.step[0] == 0:
                account.payoff[b] = lane.squared_error[0] / attacked_states(model, lane)
            for _ in range(num_steps):
                xh, change = choose(model, lane, choices[b])
                count_choice(model, lane)
                heat(model, lane, xh, change)
                move(model, lane)
                account.payoff[b] += count_errors(model, lane)
                sense(model, lane, forging[b])
                estimate(model, lane)
            report(model, lane, account, b)


@inlined
def report(model: Model, lane: State, account: Account, b: int) -> None:
    """Bring the account of a lane up to its state."""
    measure(model, lane, account.metrics[b])
    loop = observe_defender(model, lane, account.defender[b])
    observe_attacker(model, lane, account.defender[b, :loop], account.attacker[b])
