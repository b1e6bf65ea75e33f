"""The decentralised detection of an attack: does a neighbour accelerate as it would if it kept the platoon?

Detectors are leaky integrals of squared residuals.
"""

from __future__ import annotations

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.rogue.controllers import DETECTING, in_force
from cps_envs.rogue.state import Drawn, Rules, State


@inlined
def leaky(z: float, residual: float, r: Rules) -> float:
    """The detector state (m2/s3) a step later."""
    return z + r.dt_s * (residual * residual - r.leak_per_s * z)


@inlined
def raise_alarm(episode: State, i: int, ordered: int, score: Record, c: Drawn, r: Rules) -> None:
    """Latch the side whose detector has passed the threshold, the louder one where both have.

    The alarm is false if the vehicle on that side is intact, as all are before the onset.
    """
    if episode.alarm[i] == 0 and max(episode.front_detector[i], episode.rear_detector[i]) > r.alarm_threshold:
        episode.alarm[i] = 1 if episode.front_detector[i] >= episode.rear_detector[i] else -1
        if ordered == DETECTING:
            episode.controller[i] = in_force(DETECTING, episode.alarm[i])
        score.false_alarms += episode.step[0] < c.onset_step or not episode.rogue[i + episode.alarm[i]]
        if score.first_alarm_s < 0.0:
            score.first_alarm_s = episode.step[0] * r.dt_s
