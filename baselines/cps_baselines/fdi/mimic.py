"""An attacker whose lie moves like a vehicle: to a filter it is a vehicle ahead that accelerates."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array
from cps_envs.fdi.adapters.motion import Motion


class Mimic(AnalyticPolicy):
    """Lies about ranges by a t^2 / 2 and about range-rates by a t, t since the lies began to work. Sees nothing else.

    With an error e the vehicles see E = e + a t^2 / 2, which obeys E'' = d + a - u: a disturbance d and an a of its
    size look the same. `acceleration_mps2` is a; 0.5 is the best constant against `hypotheses`.

    Raises:
        ConfigurationError: there is no filter, or actions are shares of what is legal.
    """

    def __init__(self, spec: RoleSpec, *, acceleration_mps2: float = 0.5) -> None:
        super().__init__(spec)
        self.acceleration_mps2 = acceleration_mps2
        self._motion = Motion(spec)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The lies (B, 2) about range and range-rate, m and m/s."""
        return self._motion.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        return self._motion.tell(seen, state, np.full(len(seen), self.acceleration_mps2))
