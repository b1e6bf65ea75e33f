"""An attacker that looks at how the traffic behaves after its first attack, and chooses when the second one pays."""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.timed import Timed, count_platoons
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State

HALF = 0.5  # of an entry that is 0 or 1


class Adaptive(Timed):
    """Attacks, watches the mean speed of the rear half, and times its next attack by the defender it recognises.

    Below `slow_mps` nobody holds the wave back, above `fast_mps` somebody does it well. `slow_s`, `middle_s` and
    `fast_s` are the pauses after a wave that is not held back, one in between, and one that is. Further attacks follow
    at the same pause. For the jam see `Timed`.

    Raises:
        ConfigurationError: a pause that is over before the attacker looks.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        look_s: float = 38.0,
        slow_mps: float = 6.0,
        fast_mps: float = 18.0,
        slow_s: float = 90.0,
        middle_s: float = 60.0,
        fast_s: float = 40.0,
        **knobs: float,
    ) -> None:
        super().__init__(spec, **knobs)
        if not all(look_s < pause_s for pause_s in (slow_s, middle_s, fast_s)):
            raise ConfigurationError(f"pauses of {slow_s}, {middle_s}, {fast_s} s have to be above look_s = {look_s}")
        self.look_s, self.slow_mps, self.fast_mps = float(look_s), float(slow_mps), float(fast_mps)
        self.choices_s = np.round([slow_s, middle_s, fast_s])

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What `Timed` keeps, and the pause chosen for each episode, (B,) s, at first a very long one."""
        return *super().begin(generators, knowledge), np.full(len(generators), np.inf)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """See `Timed`, with the pause that was chosen."""
        *kept, chosen_s = state
        disbanded = seen["disbanded"] > HALF
        first_s = np.where(disbanded, seen["since_disbanding_s"], -np.inf).max(axis=1)
        rear = np.arange(disbanded.shape[1]) < count_platoons(seen, disbanded)[:, np.newaxis] // 2
        speed = np.where(rear, seen["mean_speed"], 0.0).sum(axis=1) / rear.sum(axis=1)
        kind = (speed >= self.slow_mps).astype(int) + (speed >= self.fast_mps)
        looks = np.isinf(chosen_s) & (first_s >= self.look_s - 1e-3)
        chosen_s = np.where(looks, self.choices_s[kind], chosen_s)
        actions, after = self.attack(seen, tuple(kept), chosen_s)
        return actions, (*after, chosen_s)
