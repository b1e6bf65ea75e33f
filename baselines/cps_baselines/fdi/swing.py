"""An attacker that lies by the clock and knows nothing of a filter: first the gap shall open, then close."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.action_form import Form
from cps_baselines.fdi.injection import InjectionPolicy, View, look, new_views
from cps_envs.core.compute.kernels import borrowed, kernel, unpack, view
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.state import Constants


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
        self._plan = np.stack([-np.rint(open * most), np.rint(close * most)]).astype(np.int64)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The first step (B,) of each attack; -1 while nothing has been injected."""
        return (np.full(len(generators), -1),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        views, first = new_views(self.form, len(seen)), state[0].copy()
        wishes = np.empty(views.attacked.shape, np.int64)
        _wish(self.form.held, seen.observation, "wait" in seen, self._plan, self.swing_steps, views, first, wishes)
        return self.say(views, wishes, seen.masks), (first,)


@kernel
def _wish(
    form: Form,
    observation: Observation,
    waits: bool,
    plan: IntArray,
    swing_steps: float,
    views: View,
    first: IntArray,
    wishes: IntArray,
) -> None:
    """Fill the views, the first steps (B,) of lies that begin, and the wishes (B, S)."""
    c = unpack(Constants, form.constants, 0)
    for b in range(observation.shape[0]):
        row, episode = borrowed(observation)[b], view(views, b)
        look(form, c, row, episode)
        works = not waits or np.rint(decode_entry(row, form.scale, form.offsets[0].wait)) == 0.0
        if works and first[b] < 0:
            first[b] = episode.step[0]
        phase = 0 if episode.step[0] - first[b] < swing_steps else 1
        for slot in range(wishes.shape[1]):
            wishes[b, slot] = plan[phase, slot] if works and episode.attacked[slot] else 0
