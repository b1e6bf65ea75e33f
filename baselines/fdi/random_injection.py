"""Random injections, legal as far as one step shows: the attackers that every other one has to beat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.fdi.action_form import Pick
from baselines.fdi.injection import InjectionPolicy, View
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.types import IntArray


class RandomInjection(InjectionPolicy):
    """Draws every attacked sensor's level uniformly from what is legal now.

    With probability `stickiness` a sensor keeps its level (or the nearest legal one) instead. `largest` bounds |level|.
    With `extremes` a sensor takes its lowest or its highest legal level, and what it keeps is the side; this is far
    stronger, since optimal attacks brake and then accelerate as hard as they may for most of the time.

    Raises:
        ConfigurationError: a stickiness outside 0 to 1, or a negative bound.
    """

    def __init__(
        self, spec: RoleSpec, *, stickiness: float = 0.0, largest: int | None = None, extremes: bool = False
    ) -> None:
        super().__init__(spec)
        if not 0 <= stickiness <= 1 or (largest is not None and largest < 0):
            raise ConfigurationError(
                f"random injections need stickiness from 0 to 1 and largest >= 0; got {stickiness} and {largest}"
            )
        self.stickiness, self.extremes = stickiness, extremes
        self.largest: IntArray = self.form.bounds if largest is None else np.minimum(self.form.bounds, largest)

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Draws (B, horizon, S, 2) of the whole episode, one for the level and one for keeping it; no level yet."""
        shape = (self.config.horizon, len(self.form.sensors), 2)
        draws = np.stack([generator.random(shape) for generator in generators])
        return draws, np.zeros((len(draws), len(self.form.sensors)), np.int64)

    def choose(self, view: View, state: State) -> tuple[Pick, State]:
        """See the class."""
        assert state is not None
        draws, last = state
        now = draws[np.arange(len(draws)), view.step]
        keeps = (now[..., 1] < self.stickiness) & (view.step > 0)[:, np.newaxis]
        taken = last.copy()  # sides, 0 = lowest, with `extremes`, else levels; filled as slots are picked

        def pick(slot: int, low: IntArray, high: IntArray) -> IntArray:
            lowest = np.minimum(np.maximum(low, -self.largest[slot]), high)
            highest = np.maximum(np.minimum(high, self.largest[slot]), lowest)
            choices = np.full(len(low), 2) if self.extremes else highest - lowest + 1
            drawn = np.floor(now[:, slot, 0] * choices).astype(np.int64) + (0 if self.extremes else lowest)
            taken[:, slot] = np.where(keeps[:, slot], last[:, slot], drawn)
            wish = np.where(taken[:, slot] > 0, highest, lowest) if self.extremes else taken[:, slot]
            return np.clip(wish, lowest, highest)

        return pick, (draws, taken)


def bang_bang(spec: RoleSpec, stickiness: float = 0.8) -> RandomInjection:
    """Full braking and full acceleration in random turns: a strong attacker that knows no target."""
    return RandomInjection(spec, stickiness=stickiness, extremes=True)
