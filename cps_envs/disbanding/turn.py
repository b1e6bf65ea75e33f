"""A turn of the game for a batch: the attacker's move, the physics, and what has been paid since the start."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, room, unpack, view
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.disbanding.attack import disband, mark_legal
from cps_envs.disbanding.dynamics import advance_episode
from cps_envs.disbanding.events import advance_eventfully
from cps_envs.disbanding.payoff import Rules, charge, measure
from cps_envs.disbanding.safety import note_gaps
from cps_envs.disbanding.state import Constants, State


class Account(NamedTuple):
    """The attacker's budget that is left, its legal attacks, and its payoff so far."""

    budget: IntArray  # (B,) platoons that the attacker may still disband
    legal: BoolArray  # (B, N + 1) or (B, 2 N) attacks
    total: FloatArray  # (B,) the attacker's payoff so far


@kernel
def step(
    state: State,
    constants: Array,
    account: Account,
    metrics: Array,
    rules: Array,
    targets: IntArray,
    correction: FloatArray,
    envs: BoolArray,
    num_steps: int,
) -> None:
    """Disband `targets` (B,) where legal, advance marked environments under `correction` (B, M) in m/s2, and settle."""
    r, closing = unpack(Rules, rules, 0), room(state.position.shape[1])
    for b in range(envs.size):
        if envs[b]:
            episode, c, own = view(state, b), unpack(Constants, constants, b), view(account, b)
            disband(episode, c, targets[b], own.budget, own.legal)
            advance_episode(episode, c, borrowed(correction)[b], closing, num_steps)
            settle(episode, c, own, borrowed(metrics)[b], r)


@kernel
def step_eventful(
    state: State,
    constants: Array,
    account: Account,
    metrics: Array,
    rules: Array,
    targets: IntArray,
    correction: FloatArray,
    envs: BoolArray,
    num_steps: int,
) -> None:
    """`step` where something happens between the integration steps, see `events.is_eventful`."""
    r, closing = unpack(Rules, rules, 0), room(state.position.shape[1])
    for b in range(envs.size):
        if envs[b]:
            episode, c, own = view(state, b), unpack(Constants, constants, b), view(account, b)
            disband(episode, c, targets[b], own.budget, own.legal)
            advance_eventfully(episode, c, borrowed(correction)[b], closing, num_steps)
            settle(episode, c, own, borrowed(metrics)[b], r)


@kernel
def settle_all(state: State, constants: Array, account: Account, metrics: Array, rules: Array, envs: BoolArray) -> None:
    """`settle` for the marked environments."""
    r = unpack(Rules, rules, 0)
    for b in range(envs.size):
        if envs[b]:
            settle(view(state, b), unpack(Constants, constants, b), view(account, b), borrowed(metrics)[b], r)


@inlined
def settle(episode: State, c: Constants, account: Account, metrics: Record, rules: Rules) -> None:
    """Bring metrics, payoff and legal attacks up to the state."""
    if rules.eventful:
        note_gaps(episode, c)
    measure(episode, c, rules.horizon_steps, metrics)
    account.total[0] = charge(episode, c, rules, metrics)
    mark_legal(episode, c, account.budget[0], rules.steps_per_decision, account.legal)
