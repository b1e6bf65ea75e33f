"""B episodes of a match, stepped under the actions of several agents: what the PettingZoo forms have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import gcd
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.declare.config import check_count
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import ConfigurationError, UnknownNameError, near, shown
from cps_envs.core.game.match import Match
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.interfaces.configured import Configured
from cps_envs.core.interfaces.info import Costs
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.setting import rival_of, setting
from cps_envs.core.learning.wired_player import WiredPlayer
from cps_envs.core.learning.wiring import Scaling, Wiring
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import AGENTS, ROLES, SIGN, Array, BoolArray, FloatArray, Generators, Observation, Role, other


class Hand:
    """A role that is played from outside, each of its agents by itself."""

    def __init__(self, match: Match, role: Role, wiring: Wiring, *, shared_pay: bool, alone: bool) -> None:
        """`alone`: no other role is played from outside."""
        self.role, self.interval, self._shared = role, match.game.decision_interval[role], shared_pay
        self.outside = Outside(match.game, role, wiring.adapter)
        self.player = WiredPlayer(self.outside, wiring, match.game.num_envs)
        wired = self.player.wired
        self.action_space = wired.action_space
        fields = self.outside.adapter.fields
        self.observation_space: spaces.Space[Any] = fields.space() if wiring.plain else wired.space()
        self.reader = ActionReader(self.action_space)
        self.names = _names(self.outside, alone=alone)
        self.hold = self.interval * (1 if self.outside.adapter.waits else wiring.frame_skip)  # game steps

    @property
    def neutral_action(self) -> Array:
        """The action of an agent that is as good as none."""
        return self.player.wired.neutral_action

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """What the agents are paid, (B, A)."""
        if self._shared:
            return np.repeat(SIGN[self.role] * payoff[:, np.newaxis], len(self.names), axis=1)
        return self.outside.rewards(payoff)


class AgentsBatch:
    """Steps B episodes. A step lasts until the first of the agents decides again.

    In the native interface that is a game step, or a decision of the role if only one is played from outside, times
    `frame_skip`; an action is read where a decision of its role is due, and holds until the next one.
    """

    def __init__(
        self,
        problem: Problem,
        num_envs: int,
        adapters: Mapping[Role, str | None],
        *,
        preset: str | None = None,
        interface: str | None = None,
        opponent: PolicyReference | None = None,
        frame_skip: int | None = None,
        flat: bool = False,
        changes: Mapping[str, Any] | None = None,
        scaling: Mapping[Role, Scaling] | None = None,
        **options: Any,
    ) -> None:
        """`adapters` names through what the roles are played that outsiders play; None: the usual one.

        `changes` are fields of the configuration that have changed since inputs were scaled as `scaling` says.

        Raises:
            ConfigurationError: an unknown preset, field or interface, or a value that cannot be right.
            UnknownNameError: there is no such adapter or opponent.
            TypeError: the role has no team.
        """
        self.problem, alone, self.changes = problem, len(adapters) == 1, dict(changes or {})
        skip = None if frame_skip is None else check_count("frame_skip", frame_skip)
        chosen = {role: setting(problem, role, preset, interface, {**options, **self.changes}) for role in adapters}
        native = any(each.interface == NATIVE for each in chosen.values())  # a role nobody learns is played as it is
        first = next(iter(chosen.values()))
        self.config, self.preset, self.overrides = first.config, first.preset, first.overrides
        self.interface = NATIVE if native else LEARNING
        if opponent is not None and not alone:
            raise ConfigurationError(
                f"opponent = {shown(opponent)} would play nobody: both roles are played from outside. Leave it out, or "
                "take an environment of one role"
            )
        self.opponent = rival_of(first, opponent) if alone else None
        rivals = {other(role): self.opponent for role in adapters} if self.opponent is not None else {}
        self.match = problem.match(self.config, num_envs, rivals)
        self.game = self.match.game
        self.hands: dict[Role, Hand] = {}
        for role, found in chosen.items():
            name = adapters[role] or (NATIVE if native else found.training.adapter)
            if native:
                plain = Wiring(problem.name, role, name, masked=True, flat=flat, plain=True)
                self.hands[role] = Hand(self.match, role, plain, shared_pay=found.training.shared_pay, alone=alone)
                continue
            training = replace(found.training, adapter=name, frame_skip=skip or found.training.frame_skip)
            known = (scaling or {}).get(role)
            wiring = replace(found, training=training).wiring(self.match, joint=False, flat=flat, scaling=known)
            self.hands[role] = Hand(self.match, role, wiring, shared_pay=training.shared_pay, alone=alone)
        game_steps = next(iter(self.hands.values())).interval if alone else 1
        holds = [hand.hold for hand in self.hands.values()]
        self.stride = game_steps * (skip or 1) if native else gcd(*holds)  # game steps of a step
        self._base = gcd(self.stride, *(hand.interval for hand in self.hands.values()))
        self.names = [name for hand in self.hands.values() for name in hand.names]
        self._held: dict[Role, Array] = {
            role: np.repeat(self.game.neutral_action[role][np.newaxis], num_envs, axis=0) for role in self.hands
        }
        self.costs = Costs(problem, self.game)

    @property
    def outward(self) -> tuple[Any, ...]:
        """What a learner was made for: it has to stay."""
        hands = self.hands.values()
        shown_by = [(tuple(hand.outside.adapter.fields), tuple(self.game.fields[hand.role])) for hand in hands]
        spaces_of = [(hand.observation_space, hand.action_space, hand.hold) for hand in hands]
        return self.names, self.stride, shown_by, spaces_of

    @property
    def scaling(self) -> dict[Role, Scaling]:
        """Mean and deviation of the inputs of each role that has scaled ones."""
        wirings = {role: hand.player.wired.wiring for role, hand in self.hands.items()}
        return {role: (each.mean, each.deviation) for role, each in wirings.items() if each.mean}

    def reset(self, envs: BoolArray, generators: Generators, drawn: Any = None) -> None:
        """Start episodes in the marked environments (B,), which draw as `Game.reset` says."""
        self.match.reset(envs, generators, drawn)
        self.costs.begin(envs)
        for hand in self.hands.values():
            hand.player.begin(envs)

    def step(self, actions: Mapping[Role, Array], envs: BoolArray) -> dict[Role, FloatArray]:
        """Go on in the marked episodes (B,) under the agents' actions (B x A, ...); their rewards (B, A)."""
        game, live = self.game, envs
        given = {role: hand.player.wired.row_actions(actions[role]) for role, hand in self.hands.items()}
        rewards = {role: np.zeros((game.num_envs, len(hand.names))) for role, hand in self.hands.items()}
        for start in range(0, self.stride, self._base):
            if start > 0:
                live = live & ~self.over()
                if not live.any():
                    break
            for role, hand in self.hands.items():
                self._decide(hand, given[role], live, looked=start == 0)
            payoff = self.match.step(self._held, live, self._base)
            for role, hand in self.hands.items():
                rewards[role] += np.where(live[:, np.newaxis], hand.rewards(payoff), 0.0)
        for hand in self.hands.values():
            seen = (game.elapsed % hand.interval == 0) | self.over() if hand.player.wired.averages else True
            hand.player.look(envs & seen)
        return rewards

    def due(self, hand: Hand) -> BoolArray:
        """The episodes (B,) in which an action that agents hand over now counts, at once or within the step."""
        marks: BoolArray = -self.game.elapsed % hand.hold < self.stride
        return marks & hand.player.due() if hand.outside.adapter.waits else marks

    def over(self) -> BoolArray:
        """The episodes (B,) that have ended."""
        ended: BoolArray = self.game.terminated | (self.game.elapsed >= self.game.horizon)
        return ended

    def state(self) -> Observation:
        """What all roles played from outside observe, and what episodes hide from them, (B, n): for central critics."""
        game = self.game
        return np.concatenate([part for role in self.hands for part in (game.observe(role), game.privileged(role))], 1)

    def state_space(self) -> spaces.Box:
        """Bounds of a state: those of observations, none of what is hidden."""
        lows, highs = [], []
        for role in self.hands:
            seen: Any = self.game.fields[role].space()
            with np.errstate(all="ignore"):  # nothing is drawn before the first reset, and only the size counts here
                hidden = np.full(self.game.privileged(role).shape[1], np.inf, np.float32)
            lows += [seen.low, -hidden]
            highs += [seen.high, hidden]
        return spaces.Box(np.concatenate(lows), np.concatenate(highs), dtype=np.float32)

    def _decide(self, hand: Hand, given: Array, live: BoolArray, *, looked: bool) -> None:
        """Let the agents of a role decide, or go on under what they have decided, where a decision of it is due."""
        due = live & (self.game.elapsed % hand.interval == 0)
        if not due.any():
            return
        marks = None if due.all() else due
        if not looked:
            hand.player.look(marks)
        hand.player.keep(given, marks)
        action = hand.player.act(marks, first=True)
        held = self._held[hand.role]
        self._held[hand.role] = np.where(due.reshape(-1, *(1,) * (held.ndim - 1)), action, held)


class AgentsForm(Configured):
    """What the single and the batched form tell of their agents."""

    overrides: Mapping[str, Any]  # fields of the configuration that are not the preset's

    def __init__(
        self,
        problem: Problem,
        name: str,
        adapters: Mapping[Role, str | None],
        num_envs: int,
        max_cycles: int | None,
        options: Mapping[str, Any],
    ) -> None:
        self.problem, self._name = problem, f"{name}_v{problem.version}"
        self._most = None if max_cycles is None else check_count("max_cycles", max_cycles)
        self._made_with = (problem, num_envs, adapters)
        self._options = dict(options)
        self._first = batch = AgentsBatch(*self._made_with, **options)
        self._use(batch)
        self.config, self.interface, self.preset = batch.config, batch.interface, batch.preset
        self.opponent, self.interval = batch.opponent, batch.stride  # game steps
        self.possible_agents = batch.names[:]
        self.agents_of = {role: tuple(hand.names) for role, hand in batch.hands.items()}
        self.roles = {name: hand.role for name, hand in self._hands.items()}
        self.state_space = batch.state_space()

    def _build(self, changes: Mapping[str, Any], rival: PolicyReference | None) -> AgentsBatch:
        options = {**self._options, "opponent": rival}
        return AgentsBatch(*self._made_with, changes=changes, scaling=self._first.scaling, **options)

    def _use(self, stage: AgentsBatch) -> None:
        self._stage = self._batch = stage
        self._hands = {name: hand for hand in stage.hands.values() for name in hand.names}
        vars(self).update(game=stage.game, overrides=stage.overrides)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The observation space of an agent in one episode, the same for every agent of a role.

        Raises:
            UnknownNameError: there is no such agent.
        """
        return self._hand(agent).observation_space

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The action space of an agent in one episode, the same for every agent of a role.

        Raises:
            UnknownNameError: there is no such agent.
        """
        return self._hand(agent).action_space

    def neutral_action(self, agent: str) -> Array:
        """The action of an agent that is as good as none, of the shape of its action space.

        Raises:
            UnknownNameError: there is no such agent.
        """
        return self._hand(agent).neutral_action

    def _hand(self, agent: str) -> Hand:
        if not isinstance(agent, str) or agent not in self._hands:
            raise UnknownNameError(f"there is no agent {shown(agent)} here. {near(str(agent), self._hands)}")
        return self._hands[agent]


def team_of(problem: Problem, role: Role, adapter: str | None) -> dict[Role, str | None]:
    """The adapter through which a role is a team.

    Raises:
        TypeError: it has none.
    """
    if adapter is None and role not in problem.swarm:
        raise TypeError(f"the {role} of {problem.name!r} has no decentralised form")
    return {role: adapter or problem.swarm[role]}


def both_of(adapters: Mapping[Role, str] | None) -> dict[Role, str | None]:
    """The adapters of both roles; None: the usual one.

    Raises:
        ConfigurationError: a key is no role.
    """
    odd = sorted(set(adapters or ()) - set(ROLES))
    if odd:
        raise ConfigurationError(f"adapters names {odd[0]!r}, which is no role: attacker, defender")
    return {role: (adapters or {}).get(role) for role in ROLES}


def _names(outside: Outside, *, alone: bool) -> list[str]:
    """The agents of a role in the environment; a team says its role where the other role is played from outside too."""
    if len(outside.agents) == 1:
        return [AGENTS[outside.role]]
    return [agent if alone else f"{outside.role}_{agent}" for agent in outside.agents]
