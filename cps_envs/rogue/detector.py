"""The decentralised detection of an attack: does a neighbour accelerate as it would if it kept the platoon?"""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.kernels import Record, clip, inlined
from cps_envs.rogue.controllers import DETECTING, in_force
from cps_envs.rogue.state import Drawn, Rules, Scratch, Side, State


class Capability(NamedTuple):
    """The accelerations that an intact vehicle is capable of at its speed, m/s2."""

    least: float
    most: float


NOBODY = Capability(0.0, 0.0)


@inlined
def capability(episode: State, i: int, c: Drawn, r: Rules) -> Capability:
    """What vehicle `i` could do if it were intact; nobody drives in reverse."""
    drag = c.drag_per_s * episode.speed[i]
    least = c.drive_mps2 * r.min_effort - drag if episode.speed[i] > 0.0 else 0.0
    return Capability(least, c.drive_mps2 * r.max_effort - drag)


@inlined
def listen(episode: State, i: int, front: Side, rear: Side, ahead: Capability, behind: Capability, r: Rules) -> None:
    """Both detectors of vehicle `i` after a step: leaky integrals of squared residuals.

    The residual is what the neighbour did in the last step beyond closing the error between the two by the sliding mode
    within the limits of an intact vehicle. The two vehicles of a pair see its errors with opposite signs.
    """
    if i + 1 < episode.speed.size:
        residual = episode.acceleration[i + 1] - clip(-front.closing, ahead.least, ahead.most)
        episode.front_detector[i] = leaky(episode.front_detector[i], residual, r)
    if i > 0:
        residual = episode.acceleration[i - 1] - clip(rear.closing, behind.least, behind.most)
        episode.rear_detector[i] = leaky(episode.rear_detector[i], residual, r)


@inlined
def leaky(z: float, residual: float, r: Rules) -> float:
    """The detector state (m2/s3) a step later."""
    return z + r.dt_s * (residual * residual - r.leak_per_s * z)


@inlined
def raise_alarm(episode: State, i: int, scratch: Scratch, score: Record, c: Drawn, r: Rules) -> None:
    """Latch the side whose detector has passed the threshold, the louder one where both have.

    The alarm is false if the vehicle on that side is intact, as all are before the onset.
    """
    if episode.alarm[i] == 0 and max(episode.front_detector[i], episode.rear_detector[i]) > r.alarm_threshold:
        episode.alarm[i] = 1 if episode.front_detector[i] >= episode.rear_detector[i] else -1
        if scratch.ordered[i] == DETECTING:
            episode.controller[i] = in_force(DETECTING, episode.alarm[i])
        score.false_alarms += episode.step[0] < c.onset_step or i + episode.alarm[i] != c.attacker
        if score.first_alarm_s < 0.0:
            score.first_alarm_s = episode.step[0] * r.dt_s
