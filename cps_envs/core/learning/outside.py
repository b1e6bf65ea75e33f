"""A role of a game that is played from outside, through an adapter."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.game import Game
from cps_envs.core.policies.adapter import Adapter, adapter_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.team import Team, grouped
from cps_envs.core.types import SIGN, Array, FloatArray, Observation, Role, State


class Outside:
    """Who plays a role of B environments from outside: one agent or a team, what they see, and what they are paid."""

    def __init__(self, game: Game, role: Role, adapter: str) -> None:
        """`adapter` is the name of one of the role's.

        Raises:
            UnknownNameError: the role has none of this name.
            ConfigurationError: it does not fit the configuration, or the game has no team of its agents.
        """
        self._game, self.role = game, role
        self.adapter: Adapter = adapter_of(game.spec(role), adapter)
        self.agents = self.adapter.agents
        self.team = self._team(adapter) if len(self.agents) > 1 or self.adapter.local else None

    def _team(self, adapter: str) -> Team:
        try:
            return grouped(self._game.team(self.role), self.agents)
        except TypeError as error:
            whole = f"the adapter {adapter!r} has {len(self.agents)} agent{'s' * (len(self.agents) > 1)}, but {error}"
            remedy = f"write {type(self._game).__name__}.team(role), see cps_envs.core.policies.team"
            raise ConfigurationError(f"{whole}: {remedy}") from error

    def seen(self) -> Seen:
        """What the role shows now, from which its agents' observations are made."""
        masks = self._game.action_mask(self.role)
        team = self.team.observe() if self.team is not None and self.adapter.local else None
        return Seen(self._game.fields[self.role], self._game.observe(self.role), None, False, masks, team)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's action (B, ...) that follows from its agents' (B, A, ...), and the adapter's next state."""
        return self.adapter.act(seen, state, actions)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """The agents' rewards (B, A) of the last step, in which the attacker was paid `payoff` (B,)."""
        if self.team is None:
            own: FloatArray = SIGN[self.role] * payoff[:, np.newaxis]
            return own
        return self.team.rewards(payoff)

    def privileged(self) -> Observation:
        """What the episodes hide, (B, A, p), for value functions in training only."""
        if self.team is None:
            return self._game.privileged(self.role)[:, np.newaxis]
        return self.team.privileged()
