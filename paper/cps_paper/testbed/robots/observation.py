"""What the defender sees of the robots, laid out as `disbanding.fields.defender_fields` of the string."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import borrowed, fill, kernel, unpack, view
from cps_envs.core.declare.fields import encode_row
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.disbanding.observation import fill_defender
from cps_envs.disbanding.state import Constants, State
from cps_paper.testbed.robots.controllers import law_commands
from cps_paper.testbed.robots.state import Rules


@kernel
def observe_robots(
    string: State,
    constants: Array,
    metrics: Array,
    rules: Array,
    offsets: Array,
    scale: FloatArray,
    encoded: Observation,
) -> None:
    """Fill `encoded` (B, size) with estimates and the controllers' commands in units of the road."""
    at, row, r = borrowed(offsets)[0], np.empty(encoded.shape[1]), unpack(Rules, rules, 0)
    robots = string.speed.shape[1]
    gap, closing, law = np.empty(robots), np.empty(robots), np.empty(robots)
    for b in range(encoded.shape[0]):
        c, episode = unpack(Constants, constants, b), view(string, b)
        law_commands(episode, c, r, gap, closing, law)
        fill(row, 0.0)
        fill_defender(episode, c, gap, closing, law, borrowed(metrics)[b], row, at)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])
