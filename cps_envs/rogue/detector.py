"""The decentralised detection of an attack: does a neighbour accelerate as it would if it kept the platoon?"""

from __future__ import annotations

from cps_envs.core.kernels import Record, clip, inlined
from cps_envs.rogue.controllers import DETECTING, in_force
from cps_envs.rogue.state import Drawn, Rules, Scratch, State


@inlined
def listen(episode: State, scratch: Scratch, c: Drawn, r: Rules) -> None:
    """Both detectors of each intact vehicle after a step: leaky integrals of squared residuals.

    The residual is what the neighbour did in the last step beyond closing the error between the two by the sliding mode
    within the limits of an intact vehicle. The two vehicles of a pair see its errors with opposite signs.
    """
    lowest, highest = c.drive_mps2 * r.min_effort, c.drive_mps2 * r.max_effort
    for i in range(episode.speed.size):
        drag = c.drag_per_s * episode.speed[i]
        scratch.least[i] = lowest - drag if episode.speed[i] > 0.0 else 0.0
        scratch.most[i] = highest - drag
    for i in range(episode.armed.size):
        expected = clip(-scratch.closing[i], scratch.least[i + 1], scratch.most[i + 1])
        episode.front_detector[i] = leaky(episode.front_detector[i], episode.acceleration[i + 1] - expected, r)
    for i in range(episode.armed.size):
        expected = clip(scratch.closing[i], scratch.least[i], scratch.most[i])
        episode.rear_detector[i + 1] = leaky(episode.rear_detector[i + 1], episode.acceleration[i] - expected, r)
    episode.front_detector[c.attacker] = episode.rear_detector[c.attacker] = 0.0


@inlined
def leaky(z: float, residual: float, r: Rules) -> float:
    """The detector state (m2/s3) a step later."""
    return z + r.dt_s * (residual * residual - r.leak_per_s * z)


@inlined
def raise_alarms(episode: State, scratch: Scratch, score: Record, r: Rules) -> None:
    """Latch the side whose detector has passed the threshold, the louder one where both have."""
    for i in range(episode.alarm.size):
        if episode.alarm[i] == 0 and max(episode.front_detector[i], episode.rear_detector[i]) > r.alarm_threshold:
            episode.alarm[i] = 1 if episode.front_detector[i] >= episode.rear_detector[i] else -1
            if scratch.ordered[i] == DETECTING:
                episode.controller[i] = in_force(DETECTING, episode.alarm[i])
            if score.first_alarm_s < 0.0:
                score.first_alarm_s = episode.step[0] * r.dt_s
