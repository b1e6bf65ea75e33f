"""What the viewer has seen of an episode: the target pair and the injections, moment by moment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.picture.history import History
from cps_envs.core.types import FloatArray
from cps_envs.fdi.picture.scene import Scene

MOST_POINTS = 600  # of a curve
TIME, GAP, CLOSING, SENSED, REPORTED_GAP, REPORTED_CLOSING, USED_GAP, USED_CLOSING = range(8)
BELIEVED_GAP, BELIEVED_CLOSING, INJECTIONS = range(8, 11)


class Peaks(NamedTuple):
    """The largest values that any vehicle has had, which scale the plots; 0 or more."""

    gap_m: float
    closing_mps: float
    opening_mps: float
    command_mps2: float
    injection: float  # m or m/s


NO_PEAKS = Peaks(0.0, 0.0, 0.0, 0.0, 0.0)


class SensorHistory:
    """Rows of an episode up to the present moment, and its peaks; see `core.picture.history`."""

    def __init__(self) -> None:
        self._moments = History(MOST_POINTS)
        self.peaks = NO_PEAKS

    def add(self, scene: Scene, step_s: float) -> None:
        """Take a moment in; the same moment again replaces what was known of it."""
        row = row_of(scene, step_s)
        if self._moments.add(scene.episode, (scene.time_s, row[SENSED]), np.array(row)):
            self.peaks = NO_PEAKS
        self.peaks = Peaks(*map(max, self.peaks, peaks_of(scene)))

    def rows(self) -> FloatArray:
        """The moments (k, INJECTIONS + q), columns as named above, q attacked sensors; thinned in long episodes."""
        return self._moments.rows()


def row_of(scene: Scene, step_s: float) -> list[float]:
    """What a moment adds; sensors were read a step before, unless an illegal injection stopped everything."""
    pair, n = scene.target - 1, len(scene.gap)
    sensed_s = scene.time_s if scene.metrics["illegal"] else scene.time_s - step_s
    row = [scene.time_s, scene.gap[pair], scene.closing_speed[pair], max(sensed_s, 0.0)]
    row += [scene.reported_gap[pair], scene.reported_closing_speed[pair]]
    row.append(np.nan if scene.trusted[pair] else scene.used_gap[pair])
    row.append(np.nan if scene.trusted[n + pair] else scene.used_closing_speed[pair])
    row += [scene.believed_gap[pair], scene.believed_closing_speed[pair]]
    return [*map(float, row), *scene.injection[scene.attacked].tolist()]


def peaks_of(scene: Scene) -> Peaks:
    """The peaks of one moment."""
    closing = scene.closing_speed
    values = (scene.gap, closing, -closing, np.abs(scene.command), np.abs(scene.injection))
    return Peaks(*(max(float(value.max()), 0.0) for value in values))
