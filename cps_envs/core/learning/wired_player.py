"""A role of B episodes that is played from outside through its wiring, what its agents see, and what they have done."""

from __future__ import annotations

import numpy as np

from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.wiring import Wired, Wiring
from cps_envs.core.types import Array, BoolArray, Observation, State


class WiredPlayer:
    """The state of a wiring beside a game that others step and reset.

    `envs` marks episodes (B,) that go on; None stands for all. What the others see and have done stays as it is.
    """

    def __init__(self, outside: Outside, wiring: Wiring, num_envs: int) -> None:
        """Begin before the first reset of the game.

        Raises:
            ConfigurationError: the scaling has another number of inputs than the adapter gives.
        """
        self.outside, self.wired = outside, Wired(wiring, outside.adapter)
        self.state = self.wired.begin(num_envs)

    def begin(self, envs: BoolArray) -> None:
        """Follow a reset of the marked episodes (B,)."""
        fresh = self.wired.begin(len(envs)) if envs.all() else self.wired.restart(self.state, envs)
        self.state = fresh
        self.look(None if envs.all() else envs)

    def look(self, envs: BoolArray | None = None) -> None:
        """See what the role shows now."""
        self._now = self.outside.seen()
        self._become(self.wired.see(self._now, self.state), envs)

    def rows(self) -> Observation:
        """Inputs (B, A, n)."""
        return self.wired.inputs(self._now, self.state)

    def masks(self) -> BoolArray | None:
        """Legal actions (B x rows, k); None where all are legal."""
        return self.wired.row_masks(self._now, self.state)

    def active(self) -> BoolArray:
        """The agents (B, A) that are there and whose action has an effect now."""
        return self.wired.active(self._now, self.state)

    def due(self) -> BoolArray:
        """The episodes (B,) in which the agents decide now."""
        return self.wired.due(self.outside.seen(), self.state)

    def keep(self, actions: Array, envs: BoolArray | None = None) -> None:
        """Keep the agents' new actions (B, A, ...) where a decision of theirs is due."""
        self._become(self.wired.keep(self._now, self.state, actions), envs)

    def act(self, envs: BoolArray | None = None, *, first: bool) -> Array:
        """The role's action (B, ...) for its next decision, the first one under the kept actions or a later one."""
        if not first:
            if self.wired.averages:
                self.look(envs)
            else:
                self._now = self.outside.seen()
        action, state = self.wired.act(self._now, self.state)
        self._become(state, envs)
        return action

    def _become(self, state: State, envs: BoolArray | None) -> None:
        if envs is not None:
            state = tuple(rows_of(new, old, envs) for new, old in zip(state, self.state, strict=True))
        self.state = state


def rows_of(new: Array, old: Array, envs: BoolArray) -> Array:
    """`new` in the marked episodes (B,), `old` in the others."""
    return new if new is old else np.where(envs.reshape(-1, *(1,) * (new.ndim - 1)), new, old)
