"""What the viewer has seen of an episode, frame by frame."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.picture.belief import flawed_sets
from cps_envs.hvac.picture.scene import Scene

MOST_POINTS = 240  # of a curve
STEP, IMPACT, INTACT_LOW, INTACT_HIGH, FLAWED_LOW, FLAWED_HIGH, ZONES = range(7)


class History:
    """Rows of an episode up to the present frame; another episode, or time that goes back, begins a new one.

    `member` (sets, S) tells the sensors of each set.
    """

    def __init__(self, member: BoolArray) -> None:
        self._member = member
        self._episode = -1
        self._rows: list[FloatArray] = []

    def add(self, scene: Scene) -> None:
        """Take a frame in; the same moment again replaces what was known of it."""
        if scene.episode != self._episode or (self._rows and scene.step < self._rows[-1][STEP]):
            self._episode, self._rows = scene.episode, []
        if self._rows and scene.step == self._rows[-1][STEP]:
            self._rows.pop()
        self._rows.append(self._row(scene))

    def rows(self) -> FloatArray:
        """The frames (k, ZONES + 2n + S), thinned in long episodes.

        Columns as named above, then true temperatures, estimates and readings. Residuals are nan where there are none.
        """
        stride = 1 + len(self._rows) // MOST_POINTS
        kept = self._rows[::stride]
        return np.array(kept if kept[-1] is self._rows[-1] else [*kept, self._rows[-1]])

    def _row(self, scene: Scene) -> FloatArray:
        flawed = flawed_sets(self._member, scene.compromised)
        groups = [value for group in (~flawed, flawed) for value in self._ends(scene, group)]
        row = [scene.step, scene.metrics["a_impact"], *groups]
        return np.concatenate([row, scene.temperature, scene.estimate, scene.reading])

    def _ends(self, scene: Scene, group: BoolArray) -> tuple[float, float]:
        """The smallest and the largest mean residual of the marked sets (sets,)."""
        if not scene.ready or not group.any():
            return np.nan, np.nan
        values = scene.mean_residual[group]
        return float(values.min()), float(values.max())
