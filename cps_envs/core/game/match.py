"""A game and the policies that play some of its roles from inside."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from functools import partial
from math import gcd
from typing import Any

import numpy as np

from cps_envs.core.compute.clock import mark_due
from cps_envs.core.compute.generators import children
from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.errors import ConfigurationError, MissingExtraError, PolicyError
from cps_envs.core.game.game import Game
from cps_envs.core.policies.policy import (
    AnalyticPolicy,
    Idle,
    Policy,
    begins,
    is_decentralised,
    privileged_of,
    repeat,
    takes_masks,
    takes_mode,
)
from cps_envs.core.policies.state import put, take
from cps_envs.core.types import (
    ROLES,
    Array,
    BoolArray,
    FloatArray,
    Generators,
    IntArray,
    Knowledge,
    Observation,
    Role,
    State,
)


class Match:
    """Steps a game whose other roles are played from outside.

    Each environment has one generator. At every reset each player is handed one spawned from it, so that no draw of a
    policy shifts a draw of the physics.
    """

    def __init__(self, game: Game, players: Mapping[Role, Policy], *, deterministic: bool = False) -> None:
        self.game = game
        self.players = {role: player for role, player in players.items() if not isinstance(player, Idle)}
        self._idle = frozenset(players) - frozenset(self.players)
        self._deterministic = deterministic
        self._states: dict[Role, State | None] = dict.fromkeys(self.players)
        self._due = np.zeros(game.num_envs, np.bool_)
        self._fresh = {role: np.ones(game.num_envs, np.bool_) for role in self.players}
        self._held = {role: repeat(game.neutral_action[role], game.num_envs) for role in self.players}
        self._readers = {role: ActionReader(game.action_space[role]) for role in self.players}
        self._masked = {role for role, player in self.players.items() if takes_masks(player)}
        self._teams = {role: game.team(role) for role, player in self.players.items() if is_decentralised(player)}
        self._beginners: dict[Role, Any] = {role: player for role, player in self.players.items() if begins(player)}
        self._stride = gcd(*(game.decision_interval[role] for role in self.players)) if self.players else 0

    def reset(self, envs: BoolArray, generators: Generators, drawn: Any = None) -> None:
        """Start new episodes in the marked environments (B,), which draw as `Game.reset` says."""
        self.game.reset(envs, generators, drawn)
        self.begin(envs, generators)

    def begin(self, envs: BoolArray, generators: Generators) -> None:
        """Let the players start with the marked environments as they are."""
        if not self.players:
            return
        for role in self.players:
            self._fresh[role][envs] = True
        if not self._beginners:
            return
        rows = envs.nonzero()[0]
        marked = rows.tolist()
        spawned = children(generators, rows, len(ROLES))
        for role, player in self._beginners.items():
            privileged = privileged_of(player)
            if marked and "truth" in privileged:
                self.game.truth(marked[0])  # a game that tells nobody says so before it is played
            told: Knowledge = [Told(self, role, b) for b in marked] if privileged else [{}] * len(marked)
            self._states[role] = put(
                self._states[role], rows, player.begin(spawned[ROLES.index(role)], told), len(envs)
            )

    def action(self, role: Role) -> Array:
        """The action (B, ...) of a player that is in force; the neutral one before its first decision."""
        return self._held.get(role, repeat(self.game.neutral_action[role], self.game.num_envs))

    def beliefs(self, role: Role) -> dict[str, Array]:
        """What a player tells of its beliefs after its last decision, by name, each (B, ...); empty if it tells none.

        A policy tells by a method `beliefs(state)`; `state` is what its `predict` returned.
        """
        tell, state = getattr(self.players.get(role), "beliefs", None), self._states.get(role)
        return {} if tell is None or state is None else dict(tell(state))

    def step(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        """Move the marked environments by `num_steps` game steps; returns the attacker's payoff (B,)."""
        if not self.players:
            return self.game.advance(actions, envs, num_steps)
        stride = gcd(self._stride, num_steps)
        payoff = np.zeros(self.game.num_envs)
        for _ in range(0, num_steps, stride):
            envs = envs > self.game.terminated  # marked and not ended, in one operation
            for role in self.players:
                self._decide(role, envs)
            paid = self.game.advance({**actions, **self._held}, envs, stride)
            payoff = payoff + paid  # in place NumPy takes several times as long
        return payoff

    def hold(
        self,
        actions: Mapping[Role, Array],
        envs: BoolArray,
        num_steps: int,
        times: int,
        limit: int,
    ) -> FloatArray:
        """`step` so many times with the same actions, and nothing observed in between.

        An environment that has ended, or gone `limit` game steps, stands still. Returns the sum of the payoffs.
        """
        payoff = self.step(actions, envs, num_steps)
        for _ in range(1, times):
            envs = envs & ~self.game.terminated & (self.game.elapsed < limit)
            if not envs.any():
                break
            payoff = payoff + self.step(actions, envs, num_steps)
        return payoff

    def _decide(self, role: Role, envs: BoolArray) -> None:
        """Renew the held actions of the environments in which a decision of this role is due."""
        due = self._due
        count = mark_due(self.game.elapsed, envs, self.game.decision_interval[role], due)
        if count == 0:
            return
        observation, start, state = self.game.observe(role), self._fresh[role], self._states[role]
        if count == len(due):
            self._held[role], self._states[role] = self._ask(role, observation, state, start, None)
            self._fresh[role] = np.zeros(len(due), np.bool_)
        else:
            rows = due.nonzero()[0]  # quicker to index with than marks are
            shown = observation.take(rows, 0)
            actions, part = self._ask(role, shown, take(state, rows), start.take(rows), rows)
            self._held[role] = self._held[role].copy()
            self._held[role][rows] = actions
            self._states[role] = put(state, rows, part, len(due))
            start[rows] = False

    def _ask(
        self, role: Role, observation: Observation, state: State | None, start: BoolArray, rows: IntArray | None
    ) -> tuple[Array, State | None]:
        """A player's checked actions in the environments `rows` that are due, None for all, and its new state."""
        player = self.players[role]
        extras = self._extras(role, rows)
        try:
            answer: Any = player.predict(observation, state, start, takes_mode(player, self._deterministic), **extras)
        except (ConfigurationError, MissingExtraError, PolicyError):  # which say what to do
            raise
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
            raise PolicyError(f"{_named(role, player)} failed in {_method(player)}: {reason}") from error
        if not (isinstance(answer, tuple) and len(answer) == 2):
            kind = type(answer).__name__
            raise ValueError(f"{_named(role, player)}: {_method(player)} returns (actions, state), not one {kind}")
        try:
            return self._readers[role].batch(answer[0], len(observation)), answer[1]
        except ValueError as error:
            raise ValueError(f"{_named(role, player)} gave impossible actions: {error}") from error

    def _extras(self, role: Role, rows: IntArray | None) -> dict[str, Array]:
        """What a player wants to know beside its observation, in the environments `rows`, or all."""
        extras: dict[str, Array] = {}
        mask = self.game.action_mask(role) if role in self._masked else None
        if mask is not None:
            extras["action_masks"] = mask if rows is None else mask.take(rows, 0)
        if role in self._teams:
            shown = self._teams[role].observe()
            extras["team_observation"] = shown if rows is None else shown.take(rows, 0)
        return extras


class Told:
    """What a privileged policy is told of one episode; `told["truth"]` asks the match anew each time.

    A policy may keep it in its state, and asks again at each decision: a copy of the match has copies of what it told,
    which ask the copy.
    """

    def __init__(self, match: Match, role: Role, b: int) -> None:
        self._match, self._role, self._b = match, role, b

    def __getitem__(self, name: str) -> Any:
        """Copies of the episode to plan on, called with their number ("model"); "truth"; or the "opponent".

        Raises:
            KeyError: the policy has not declared that it is told this.
            TypeError: the game tells nobody.
        """
        match, players = self._match, self._match.players
        if name not in privileged_of(players[self._role]):
            kind = type(players[self._role]).__name__
            raise KeyError(f"{kind} is not told {name!r}: it has to name it in `privileged`")
        if name == "truth":
            return deepcopy(match.game.truth(self._b))
        if name == "model":
            return partial(match.game.model, self._b)
        if name == "opponent":
            return next((player for role, player in players.items() if role != self._role), None)
        raise KeyError(f"{name!r} is not known: a policy may be privileged to know model, truth or opponent")


def _named(role: Role, player: Policy) -> str:
    return f"the {role}'s policy {type(player).__name__}"


def _method(player: Policy) -> str:
    """Where its author has written what it plays."""
    return "act" if isinstance(player, AnalyticPolicy) else "predict"
