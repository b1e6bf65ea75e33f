"""A learner's decisions of B episodes, each as one function of one environment: what a thread of a GPU plays.

It is `LearningSide.step` between two `Match` steps, said for one environment: the kept action, so many game steps in
which the other role decides too, then the start of the next episode where one has ended, and the inputs of a network.
The games, adapters and policies are those of the CPU, by what they offer `inside`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import gcd
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.compute.generators import Lazy, start
from cps_envs.core.compute.kernels import copy, fill, room
from cps_envs.core.compute.streams import uniform
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.match import Match
from cps_envs.core.learning.side import LearningSide
from cps_envs.core.learning.wiring import average, fill_inputs
from cps_envs.core.policies.inside import InsidePolicy
from cps_envs.core.policies.mixture import Mixture
from cps_envs.core.policies.policy import AnalyticPolicy, Idle, Policy, begins
from cps_envs.core.types import ROLES, SIGN, Array, BoolArray, FloatArray, IntArray, Observation, other


class Clock(NamedTuple):
    """Where the episodes of a batch stand."""

    elapsed: IntArray  # (B,) game steps
    over: BoolArray  # (B,) ended by physics
    streams: Array  # (B, 6) of the game's generators
    words: Array  # (B, k) of 32 bits, the seeds
    sizes: IntArray  # (B,) how many of them count
    spawned: IntArray  # (B,) children that the generators have had
    live: BoolArray  # (B,) for kernels: those that move, or begin


class Learner(NamedTuple):
    """A learning role of B episodes with A agents, see `wiring.Wired`."""

    chosen: Array  # (B, A, j) what the network says
    force: BoolArray  # (B,) episodes that end now whatever happens
    kept: Array  # (B, A, j) in force
    seen: Observation  # (B, n) of the role
    action: Array  # (B, ...) of the role
    shown: Observation  # (B, A, m) by the adapter
    averages: Observation  # (B, A, k, m)
    active: BoolArray  # (B, A)
    age: IntArray  # (B,) decisions of the role since the start of the episode
    inputs: Observation  # (B, A, columns)
    rewards: FloatArray  # (B,)
    terminated: BoolArray  # (B,) the episode has ended in this decision, and the inputs are those of the next one
    total: FloatArray  # (B,) what the role has been paid in the episode
    length: IntArray  # (B,) decisions of the network in the episode
    returned: FloatArray  # (B,) `total` of the episode that has ended now, else 0
    lasted: IntArray  # (B,) its `length`, else 0


class Rival(NamedTuple):
    """The other role of B episodes."""

    seen: Observation  # (B, n)
    action: Array  # (B, ...) in force
    fresh: Array  # (1, ...) the neutral action


class Scale(NamedTuple):
    """What the wiring knows, see `wiring.fill_inputs`; of the neutral action (1, A, ...) what agents keep at first."""

    recent: FloatArray  # (k,) gains of the running averages
    mean: Observation
    scale: Observation
    choices: IntArray
    neutral: Array
    no_changes: Observation  # (1, 1, 0)


class World(NamedTuple):
    """All arrays of B episodes, as far as a decision needs them."""

    held: Any  # the game's
    clock: Clock
    learner: Learner
    scale: Scale
    known: Any  # of the adapter
    memory: Any
    rival: Rival
    policy: Any  # what the other role's policy knows
    state: Any  # and remembers


class Drawn(NamedTuple):
    """What a mixture remembers: which policy plays, and what all of them remember."""

    place: IntArray  # (B,) among its policies
    members: Any


class Mixed(NamedTuple):
    """What a mixture knows: up to which share each policy plays, and what they know."""

    bounds: FloatArray  # (k,)
    members: Any


class Both(NamedTuple):
    """What a policy of a mixture knows or remembers, and what the ones after it do."""

    first: Any
    rest: Any


@dataclass(frozen=True)
class Card:
    """A role's decisions: the world of B episodes, and the function that plays one of environment b."""

    world: World
    decide: Callable[[World], None]


def policy_inside(policy: Policy) -> InsidePolicy | None:
    """What a policy, or each of a mixture, offers; None where one does not."""
    if isinstance(policy, Mixture):
        found = [policy_inside(each) for each in policy.policies]
        return None if None in found else _mixed(policy, [each for each in found if each is not None])
    return policy.inside() if isinstance(policy, AnalyticPolicy) else None


def _mixed(policy: Mixture, members: list[InsidePolicy]) -> InsidePolicy:
    """A mixture, which draws one of its policies at the start of each episode."""
    known, memory, begin_all, act_one = _chained(members)

    def begin(mixed: Mixed, drawn: Drawn, stream: Array) -> None:
        share, index = uniform(stream), 0
        while index < mixed.bounds.size - 1 and mixed.bounds[index] <= share:
            index += 1
        drawn.place[0] = index
        begin_all(mixed.members, drawn.members, stream)

    def act(mixed: Mixed, drawn: Drawn, seen: Observation, action: Array) -> None:
        act_one(drawn.place[0], mixed.members, drawn.members, seen, action)

    def remember(count: int) -> Drawn:
        return Drawn(np.zeros(count, np.int64), memory(count))

    return InsidePolicy(Mixed(policy.bounds, known), remember, begin, act)


def _chained(members: list[InsidePolicy]) -> tuple[Any, Callable[[int], Any], Any, Any]:
    """What several policies know, what they remember, how all of them begin, and how that of an index acts."""
    first, *others = members
    first_begin, first_act = first.begin, first.act
    if not others:

        def act_last(index: int, known: Any, memory: Any, seen: Observation, action: Array) -> None:
            first_act(known, memory, seen, action)

        return first.known, first.memory, first_begin, act_last
    rest_known, rest_memory, rest_begin, rest_act = _chained(others)

    def begin(known: Both, memory: Both, stream: Array) -> None:
        first_begin(known.first, memory.first, stream)
        rest_begin(known.rest, memory.rest, stream)

    def act(index: int, known: Both, memory: Both, seen: Observation, action: Array) -> None:
        if index == 0:
            first_act(known.first, memory.first, seen, action)
        else:
            rest_act(index - 1, known.rest, memory.rest, seen, action)

    return Both(first.known, rest_known), lambda count: Both(first.memory(count), rest_memory(count)), begin, act


def check_side(match: Match, side: LearningSide) -> None:
    """Raise where this role cannot be played inside.

    Raises:
        ConfigurationError: something has no functions of one environment; the message says what.
    """
    wiring, role, adapter = side.wired.wiring, side.wired.wiring.role, side.outside.adapter
    without = 'leave device = "cuda" out, or'
    if adapter.inside() is None:
        raise ConfigurationError(f"the adapter {wiring.adapter!r} does not play on a GPU: {without} name another one")
    for name, found, remedy in (
        ("inputs of a whole team in one row", side.wired.together > 1, "leave per_agent as it is"),
        ("actions in one number (flat)", wiring.flat, "leave flat out"),
        ("legal actions as inputs", wiring.masked, "choose another adapter"),
        ("rough_s", wiring.rough_s > 0, "leave it out"),
        ("a payoff of one's own", match.game.objective is not None, "leave payoff out"),
        ("several agents that are paid their own parts", side.rows > 1, "choose another adapter"),
    ):
        if found:
            raise ConfigurationError(f"{name}: not on a GPU. Either {without} {remedy}")
    rival = match.players.get(other(role))
    if rival is not None and policy_inside(rival) is None:
        parts = [each for each in getattr(rival, "policies", (rival,)) if policy_inside(each) is None]
        named = ", ".join(sorted({type(each).__name__ for each in parts}))
        raise ConfigurationError(
            f"the {other(role)}'s {named} cannot come along to a GPU: {without} name an opponent that can, such as "
            'opponent="none"; docs/speed.md lists them'
        )


def card_of(match: Match, side: LearningSide, generators: Lazy) -> Card:
    """A role's decisions, with the arrays of a match whose episodes have not begun.

    Raises:
        ConfigurationError: something has no functions of one environment.
    """
    check_side(match, side)
    game, wired, role = match.game, side.wired, side.wired.wiring.role
    count, physics, rival = game.num_envs, game.inside(), other(role)
    adapter: Any = side.outside.adapter.inside()
    player = match.players.get(rival) or Idle(game.spec(rival))
    policy: Any = policy_inside(player)
    row, averages, _, kept, age = wired.begin(count)[:5]
    kept = kept.reshape(*row.shape[:2], -1)
    neutral, spaces = game.neutral_action, game.fields
    kinds = {each: np.repeat(np.asarray(neutral[each])[np.newaxis], count, axis=0) for each in ROLES}
    size = wired.columns.scaled + wired.columns.last_action
    marks, numbers, counts = np.zeros(count, np.bool_), np.zeros(count), np.zeros(count, np.int64)
    world = World(
        held=physics.held,
        clock=Clock(game.elapsed, game.terminated, generators.streams, *generators.seeds, counts, marks.copy()),
        learner=Learner(
            chosen=kept.copy(),
            force=marks.copy(),
            kept=kept,
            seen=np.zeros((count, spaces[role].size), np.float32),
            action=kinds[role],
            shown=row,
            averages=averages,
            active=np.zeros(row.shape[:2], np.bool_),
            age=age,
            inputs=np.zeros((count, row.shape[1], size), np.float32),
            rewards=numbers.copy(),
            terminated=marks.copy(),
            total=numbers.copy(),
            length=counts.copy(),
            returned=numbers.copy(),
            lasted=counts.copy(),
        ),
        scale=Scale(wired.recent, *wired.scaled, kept[:1].copy(), np.zeros((1, 1, 0), np.float32)),
        known=adapter.known,
        memory=adapter.memory(count),
        rival=Rival(np.zeros((count, spaces[rival].size), np.float32), kinds[rival], kinds[rival][:1].copy()),
        policy=policy.known,
        state=policy.memory(count),
    )
    intervals = game.decision_interval
    known = Rhythm(
        skip=side.frame_skip,
        interval=intervals[role],
        rival_interval=intervals[rival],
        stride=gcd(intervals[role], intervals[rival]) if rival in match.players else intervals[role],
        horizon=game.horizon,
        sign=SIGN[role],
        attacks=role == "attacker",
        decides=rival in match.players,
        begins=any(begins(each) for each in match.players.values()),
        child=ROLES.index(rival),
        looks=wired.averages,
    )
    shows = physics.observe[role], physics.observe[rival]
    return Card(world, make_decide(known, physics.reset, physics.advance, *shows, adapter, policy))


class Rhythm(NamedTuple):
    """Numbers of a match that a kernel knows."""

    skip: int  # decisions of the role for which an action is kept
    interval: int  # game steps between its decisions
    rival_interval: int
    stride: int  # game steps, after which somebody may decide
    horizon: int
    sign: float
    attacks: bool  # whether the learner is the attacker
    decides: bool  # whether somebody plays the other role
    begins: bool  # whether it wants to know when episodes start
    child: int  # which of a generator's children is its own
    looks: bool  # whether the learner sees every decision


def make_decide(
    rhythm: Rhythm, reset: Any, advance: Any, observe: Any, observe_rival: Any, adapter: Any, policy: Any
) -> Callable[[World], None]:
    """The function that plays a decision of one environment."""
    skip, interval, rival_interval, stride, horizon, sign = rhythm[:6]
    attacks, decides, begins_too, child, looks = rhythm[6:]
    begin, look, active, act = adapter.begin, adapter.observe, adapter.active, adapter.act
    rival_begin, rival_act = policy.begin, policy.act

    def decide(w: World) -> None:
        clock, mine, theirs = w.clock, w.learner, w.rival
        live, payoff, stream, first = clock.live, room(1), room(6, np.uint64), room(1, np.bool_)
        for a in range(mine.active.shape[1]):
            source = mine.chosen if mine.active[0, a] else w.scale.neutral
            copy(source[0, a], mine.kept[0, a])
        paid = 0.0
        for decision in range(skip):
            if clock.over[0] or clock.elapsed[0] >= horizon:
                break
            if decision > 0:
                observe(w.held, mine.seen)
                if looks:
                    look(w.known, w.memory, mine.seen, mine.shown)
                    first[0] = mine.age[0] == 0
                    average(mine.shown, first, w.scale.recent, mine.averages)
            act(w.known, w.memory, mine.seen, mine.kept, mine.action)
            mine.age[0] += 1
            gained = 0.0
            for _ in range(0, interval, stride):
                live[0] = not clock.over[0]
                if decides and live[0] and clock.elapsed[0] % rival_interval == 0:
                    observe_rival(w.held, theirs.seen)
                    rival_act(w.policy, w.state, theirs.seen, theirs.action)
                payoff[0] = 0.0
                for _step in range(stride):
                    live[0] = not clock.over[0]
                    if attacks:
                        advance(w.held, mine.action, theirs.action, live, payoff)
                    else:
                        advance(w.held, theirs.action, mine.action, live, payoff)
                gained += payoff[0]
                clock.elapsed[0] += stride
            paid += gained
        ended = clock.over[0] or clock.elapsed[0] >= horizon
        mine.rewards[0] = sign * paid
        mine.total[0] += sign * paid
        mine.length[0] += 1
        mine.terminated[0] = ended
        mine.returned[0] = mine.total[0] if ended else 0.0
        mine.lasted[0] = mine.length[0] if ended else 0
        if ended or mine.force[0]:
            live[0], clock.over[0] = True, False
            clock.elapsed[0] = mine.length[0] = mine.age[0] = 0
            mine.total[0] = 0.0
            reset(w.held, clock.streams, live)
            if begins_too:
                start(clock.words[0, : clock.sizes[0]], clock.spawned[0] + child, stream)
                clock.spawned[0] += 2
                rival_begin(w.policy, w.state, stream)
            copy(theirs.fresh.reshape(-1), theirs.action.reshape(-1))
            begin(w.known, w.memory, stream)
            for a in range(mine.kept.shape[1]):
                copy(w.scale.neutral[0, a], mine.kept[0, a])
            fill(mine.averages.reshape(-1), 0.0)
        observe(w.held, mine.seen)
        look(w.known, w.memory, mine.seen, mine.shown)
        active(w.known, w.memory, mine.seen, mine.active)
        first[0] = mine.age[0] == 0
        average(mine.shown, first, w.scale.recent, mine.averages)
        scale = w.scale
        given = (mine.shown, mine.averages, scale.no_changes, mine.kept, mine.age)
        fill_inputs(*given, scale.mean, scale.scale, scale.choices, mine.inputs)

    return decide


def batched(one: World, two: World) -> list[bool]:
    """Which arrays have an axis of B environments: those that differ between worlds of one and two."""
    from cps_envs.core.compute.gpu import leaves

    return [a.shape != b.shape for (_, a), (_, b) in zip(leaves(one), leaves(two), strict=True)]
