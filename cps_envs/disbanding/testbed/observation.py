"""What the defender sees of the robots, laid out as `disbanding.fields.defender_fields` of the string."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.constants import constants_of, episode_of
from cps_envs.disbanding.observation import fill_broadcast, fill_road, fill_vehicles
from cps_envs.disbanding.state import State
from cps_envs.disbanding.testbed.platoons import law_commands
from cps_envs.disbanding.testbed.rules import Rules
from cps_envs.disbanding.testbed.state import Floats


@kernel
def observe_robots(string: State, parameters: NDArray[np.void], table: Floats, rules: Rules, out: Floats) -> None:
    """Fill `out` (B, size) with estimates and the laws' commands in units of the road."""
    out[:] = 0.0
    for b in range(out.shape[0]):
        c, episode, row = constants_of(parameters, b), episode_of(string, b), out[b]
        gap, closing, law = np.empty(c.num_vehicles), np.empty(c.num_vehicles), np.empty(c.num_vehicles)
        law_commands(episode, c, rules, gap, closing, law)
        time_s = episode.step[0] * c.dt_s
        fill_vehicles(episode, c, gap, closing, law, row, time_s)
        fill_broadcast(episode, c, gap, law, row, time_s)
        fill_road(c, time_s, table[b], row)
