"""An attacker that lies by the clock and knows nothing of a filter: first the gap shall open, then close."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.injection import InjectionPolicy, view_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array


class Swing(InjectionPolicy):
    """Lies so that the vehicle brakes for `swing_s`, then so that it accelerates.

    `open` and `close` are the parts, from 0 to 1, of the largest range-rate injection, and times `range_part` of the
    largest range injection. This is how optimal attacks on an undefended platoon look.

    Raises:
        ConfigurationError: a negative time, or parts outside 0 to 1.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        swing_s: float = 2.0,
        open: float = 1.0,
        close: float = 1.0,
        range_part: float = 1.0,
    ) -> None:
        super().__init__(spec)
        if swing_s < 0 or not all(0 <= part <= 1 for part in (open, close, range_part)):
            raise ConfigurationError("swing needs swing_s of 0 or more, and open, close and range_part from 0 to 1")
        self.swing_steps = swing_s / self.config.dt_s
        ranges = self.form.sensors < self.config.num_readings // 2
        most = self.form.bounds * np.where(ranges, range_part, 1.0)
        self._opening, self._closing = -np.rint(open * most), np.rint(close * most)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The first step (B,) of each attack; -1 while nothing has been injected."""
        return (np.full(len(generators), -1),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        views = view_of(self.form, seen)
        works = np.rint(seen["wait"][:, 0]) == 0 if "wait" in seen else np.ones(len(seen), np.bool_)
        first = np.where(works & (state[0] < 0), views.step, state[0])
        opens = (views.step - first < self.swing_steps)[:, np.newaxis]
        wishes = np.where(opens, self._opening, self._closing) * (works[:, np.newaxis] & views.attacked)
        return self.say(views, wishes.astype(np.int64), seen.masks), (first,)
