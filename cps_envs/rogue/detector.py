"""The decentralised detection of an attack: does a neighbour accelerate as it would if it kept the platoon?"""

from __future__ import annotations

from cps_envs.rogue.commands import sliding
from cps_envs.rogue.kernel import Record, clip, kernel


@kernel
def listen(z: float, e: float, d: float, neighbour: Record, episode: Record, r: Record) -> float:
    """The detector state z (m2/s3) of one side after a step: a leaky integral of the squared residual.

    `e` and `d` are our own errors on that side. The residual is what the neighbour did in the last step beyond closing
    them by the sliding mode within the limits of an intact vehicle.
    """
    drag = episode.drag_per_s * neighbour.speed
    low = episode.drive_mps2 * r.min_effort - drag if neighbour.speed > 0.0 else 0.0
    high = episode.drive_mps2 * r.max_effort - drag
    residual = neighbour.acceleration - clip(sliding(-e, -d, r.max_acceleration_mps2, r), low, high)
    return float(z + r.dt_s * (residual * residual - r.leak_per_s * z))


@kernel
def raise_alarm(me: Record, log: Record, r: Record) -> None:
    """Latch the side whose detector has passed the threshold, the louder one where both have."""
    if me.alarm == 0 and max(me.front_detector, me.rear_detector) > r.alarm_threshold:
        me.alarm = 1 if me.front_detector >= me.rear_detector else -1
        if log.first_alarm_s < 0.0:
            log.first_alarm_s = log.step * r.dt_s
