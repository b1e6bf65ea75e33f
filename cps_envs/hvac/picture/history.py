"""What the viewer keeps of each moment of an episode: a row of numbers for its curves."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.picture.belief import flawed_sets
from cps_envs.hvac.picture.scene import Scene

MOST_POINTS = 240  # of a curve
STEP, IMPACT, INTACT_LOW, INTACT_HIGH, FLAWED_LOW, FLAWED_HIGH, ZONES = range(7)


def row_of(scene: Scene, member: BoolArray) -> FloatArray:
    """A moment as a row (ZONES + 2n + S,); `member` (sets, S) tells the sensors of each set.

    Columns as named above, then true temperatures, estimates and readings. Residuals are nan where there are none.
    """
    flawed = flawed_sets(member, scene.compromised)
    groups = [value for group in (~flawed, flawed) for value in _ends(scene, group)]
    row = [scene.step, scene.metrics["a_impact"], *groups]
    return np.concatenate([row, scene.temperature, scene.estimate, scene.reading])


def _ends(scene: Scene, group: BoolArray) -> tuple[float, float]:
    """The smallest and the largest mean residual of the marked sets (sets,)."""
    if not scene.ready or not group.any():
        return np.nan, np.nan
    values = scene.mean_residual[group]
    return float(values.min()), float(values.max())
