"""A role of B episodes as its outside sees and plays it: in its own actions, or through the interface for learners."""

from __future__ import annotations

from abc import ABC, abstractmethod
from itertools import count
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import choices_of, flat_masks, flattened, unflattened
from cps_envs.core.game.match import Match
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.wired_player import WiredPlayer
from cps_envs.core.learning.wiring import Wiring
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Observation, Role


class Side(ABC):
    """What is alike: spaces of a row, of which each episode has `rows`, and how long an action is held."""

    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any]
    rows: int = 1
    frame_skip: int  # decisions of the role
    masked: bool = False  # whether not all actions are always legal
    waits: bool = False  # whether a step ends as soon as something is to be decided again

    @property
    @abstractmethod
    def neutral_action(self) -> Array:
        """The action of a row that is as good as none."""

    @abstractmethod
    def begin(self, envs: BoolArray) -> None:
        """Follow a reset of the marked episodes (B,)."""

    @abstractmethod
    def observe(self) -> Observation:
        """The rows (B x rows, n)."""

    @abstractmethod
    def masks(self) -> BoolArray | None:
        """Legal actions of the rows (B x rows, k), of MultiDiscrete ones side by side; None where all are legal."""

    @abstractmethod
    def step(self, actions: Array, envs: BoolArray, limit: int) -> tuple[FloatArray, FloatArray]:
        """Hold actions (B x rows, ...) in the marked episodes (B,), to their end or `limit` game steps at the most.

        Returns the attacker's payoff (B,) and the rewards of the rows (B x rows,).
        """


class NativeSide(Side):
    """The role as it is: what it observes and does in the game, and nothing in between."""

    def __init__(self, match: Match, role: Role, frame_skip: int, *, flat: bool) -> None:
        """`flat`: one number for all entries of an action.

        Raises:
            ConfigurationError: `flat` cannot be.
        """
        self._match, self._game, self._role, self.frame_skip = match, match.game, role, frame_skip
        self._interval = match.game.decision_interval[role]
        own = match.game.action_space[role]
        self._choices = choices_of(own) if flat else ()
        self.observation_space = match.game.fields[role].space()
        self.action_space = flattened(own) if flat else own
        self.masked = match.game.action_mask(role) is not None

    @property
    def neutral_action(self) -> Array:
        """The game's."""
        own = self._game.neutral_action[self._role]
        return np.asarray(np.ravel_multi_index(tuple(np.ravel(own)), self._choices)) if self._choices else own

    def begin(self, envs: BoolArray) -> None:
        """Nothing is kept."""

    def observe(self) -> Observation:
        """(B, n)."""
        return self._game.observe(self._role)

    def masks(self) -> BoolArray | None:
        """(B, k)."""
        masks = self._game.action_mask(self._role)
        return flat_masks(masks, self._choices) if self._choices and masks is not None else masks

    def step(self, actions: Array, envs: BoolArray, limit: int) -> tuple[FloatArray, FloatArray]:
        """See `Side.step`."""
        own = unflattened(actions, self._choices) if self._choices else actions
        own = own.reshape(len(own), *(self._game.action_space[self._role].shape or ()))
        payoff = self._match.hold({self._role: own}, envs, self._interval, self.frame_skip, limit)
        return payoff, SIGN[self._role] * payoff


class LearningSide(Side):
    """The role through a wiring: an adapter, held decisions, running averages, scaled inputs, agents as rows."""

    def __init__(self, match: Match, role: Role, wiring: Wiring, *, shared_pay: bool = False) -> None:
        """Wire it; with `shared_pay` each agent of a team is paid what the whole team is.

        Raises:
            UnknownNameError: there is no such adapter.
            ConfigurationError: the adapter, the scaling or `flat` does not fit.
        """
        self._match, self._game, self._role = match, match.game, role
        self._interval, self.frame_skip = match.game.decision_interval[role], wiring.frame_skip
        self.outside = Outside(match.game, role, wiring.adapter)
        self.player = WiredPlayer(self.outside, wiring, match.game.num_envs)
        self.wired = self.player.wired
        self.rows, self.action_space = self.wired.rows, self.wired.action_space
        self.masked, self.waits = wiring.masked, self.outside.adapter.waits
        self._whole = shared_pay or self.rows == 1  # whether rows are paid what the role is
        self.observation_space = self.wired.space()

    @property
    def neutral_action(self) -> Array:
        """The adapter's, of every agent of a row."""
        return self.wired.neutral_action

    def begin(self, envs: BoolArray) -> None:
        """Let the agents start."""
        self.player.begin(envs)

    def observe(self) -> Observation:
        """(B x rows, n)."""
        shown = self.player.rows()
        return shown.reshape(len(shown) * self.rows, -1)

    def masks(self) -> BoolArray | None:
        """(B x rows, k)."""
        return self.player.masks()

    def step(self, actions: Array, envs: BoolArray, limit: int) -> tuple[FloatArray, FloatArray]:
        """See `Side.step`. A row of several agents is paid what the role is paid."""
        game, player, begun = self._game, self.player, _some(envs)
        player.keep(self.wired.row_actions(actions), begun)
        paid, live = np.zeros(game.num_envs), envs
        rewards = np.zeros((game.num_envs, self.rows))
        for decision in count():
            if decision > 0:
                live = live & ~game.terminated & (game.elapsed < limit)
                live = live & self._held(decision) if live.any() else live
                if not live.any():
                    break
            action = player.act(_some(live), first=decision == 0)
            payoff = self._match.step({self._role: action}, live, self._interval)
            paid += payoff
            if not self._whole:
                rewards += np.where(live[:, np.newaxis], self.outside.rewards(payoff), 0.0)
        player.look(begun)
        return paid, np.repeat(SIGN[self._role] * paid, self.rows) if self._whole else rewards.reshape(-1)

    def _held(self, decision: int) -> BoolArray:
        """The episodes (B,) that go on under what the agents have chosen so many decisions of the role ago."""
        if decision < self.frame_skip and self.outside.adapter.waits:
            return ~self.player.due()
        return np.full(self._game.num_envs, decision < self.frame_skip)


def _some(envs: BoolArray) -> BoolArray | None:
    """The marks, or None where all are marked."""
    return None if envs.all() else envs
