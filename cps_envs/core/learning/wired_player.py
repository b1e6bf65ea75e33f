"""A role of B episodes that is played from outside through its wiring, what its agents see, and what they have done."""

from __future__ import annotations

import numpy as np

from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.learning.wiring import Wired, Wiring
from cps_envs.core.types import Array, BoolArray, Observation


class WiredPlayer:
    """The state of a wiring beside a game that others step and reset."""

    def __init__(self, outside: Outside, wiring: Wiring, num_envs: int) -> None:
        """Begin before the first reset of the game.

        Raises:
            ConfigurationError: the scaling has another number of inputs than the adapter gives.
        """
        self.outside, self.wired = outside, Wired(wiring, outside.adapter)
        self.state = self.wired.begin(num_envs)

    def begin(self) -> None:
        """Follow a reset of all episodes."""
        self.state = self.wired.begin(len(self.state[0]))
        self.look()

    def restart(self, envs: BoolArray) -> None:
        """Follow a reset of the marked episodes (B,)."""
        fresh, self._now = self.wired.restart(self.state, envs), self.outside.seen()
        looked = self.wired.see(self._now, fresh)
        self.state = tuple(_rows_of(new, old, envs) for new, old in zip(looked, fresh, strict=True))

    def look(self) -> None:
        """See what the role shows now."""
        self._now = self.outside.seen()
        self.state = self.wired.see(self._now, self.state)

    def rows(self) -> Observation:
        """Inputs (B, A, n)."""
        return self.wired.inputs(self._now, self.state)

    def active(self) -> BoolArray:
        """The agents (B, A) that are there and whose action has an effect now."""
        return self.wired.active(self._now, self.state)

    def keep(self, actions: Array) -> None:
        """Keep the agents' new actions (B, A, ...)."""
        self.state = self.wired.keep(self._now, self.state, actions)

    def act(self, *, first: bool) -> Array:
        """The role's action for its next decision, the first one under the kept actions or a later one."""
        if not first:
            if self.wired.averages:
                self.look()
            else:
                self._now = self.outside.seen()
        action, self.state = self.wired.act(self._now, self.state)
        return action


def _rows_of(new: Array, old: Array, envs: BoolArray) -> Array:
    """`new` in the marked episodes (B,), `old` in the others."""
    return np.where(envs.reshape(-1, *(1,) * (new.ndim - 1)), new, old)
