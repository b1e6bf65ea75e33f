"""What each vehicle wants: errors, detectors, and the law in force (section 2 and 4 of the specification)."""

from __future__ import annotations

from typing import TypeAlias

from cps_envs.rogue.commands import drive_back, drive_behind, drive_freely, linear, scheduled_authority, sliding
from cps_envs.rogue.detector import listen, raise_alarm
from cps_envs.rogue.kernel import Record, clip, kernel
from cps_envs.rogue.laws import DETECTING, FRONT, HUMAN, LINEAR, REAR, SLIDING

Errors: TypeAlias = tuple[float, float]


@kernel
def front_errors(me: Record, ahead: Record, leads: bool, reference_m: float, episode: Record, r: Record) -> Errors:
    """e_f (m) and d_f (m/s); those of the leader are to the reference, without a separation."""
    if leads:
        return reference_m - me.position, episode.reference_speed_mps - me.speed
    return ahead.position - me.position - r.separation_m, ahead.speed - me.speed


@kernel
def rear_errors(me: Record, behind: Record, trails: bool, r: Record) -> Errors:
    """e_r (m) and d_r (m/s); zero where nobody is behind."""
    if trails:
        return 0.0, 0.0
    return behind.position - me.position + r.separation_m, behind.speed - me.speed


@kernel
def law_in_force(ordered: int, alarm: int) -> int:
    """The law that a vehicle drives by: `DETECTING` stands for one of three."""
    if ordered != DETECTING:
        return ordered
    return FRONT if alarm > 0 else REAR if alarm < 0 else SLIDING


@kernel
def follow(me: Record, e: float, d: float, modified: bool, log: Record, r: Record) -> float:
    """Acceleration (m/s2) of following one side, plainly or by the modified law (5.12) to (5.14).

    The modified law also grows the separation, with effect from the next step. `e` already contains the growth so far.
    """
    if not modified:
        return sliding(e, d, r.max_acceleration_mps2, r)
    if log.step % r.growth_steps == 0 and abs(e) < r.inner_share * r.separation_m:
        me.growth = min(me.growth + r.growth_step_m, r.max_growth_m)
    return sliding(e, d, scheduled_authority(e, d, r), r)


@kernel
def drive_by_hand(me: Record, leads: bool, e: float, d: float, episode: Record, r: Record) -> float:
    """Acceleration (m/s2) of a human, who ignores what is behind; `e` and `d` are the errors on the front side."""
    wanted = episode.reference_speed_mps
    if not leads:
        return drive_behind(e + r.separation_m, d, me.speed, wanted, r)
    return drive_back(e, d) if r.human_returns else drive_freely(me.speed, wanted, r)


@kernel
def decide(
    me: Record,
    ahead: Record,
    behind: Record,
    leads: bool,
    trails: bool,
    ordered: int,
    modified: bool,
    acceleration: float,
    reference_m: float,
    episode: Record,
    log: Record,
    r: Record,
) -> float:
    """Sense, watch and decide: the desired acceleration (m/s2) of an intact vehicle in this step."""
    e_front, d_front = front_errors(me, ahead, leads, reference_m, episode, r)
    e_rear, d_rear = rear_errors(me, behind, trails, r)
    if not leads:
        me.front_detector = listen(me.front_detector, e_front, d_front, ahead, episode, r)
    if not trails:
        me.rear_detector = listen(me.rear_detector, e_rear, d_rear, behind, episode, r)
    raise_alarm(me, log, r)
    law = law_in_force(ordered, me.alarm)
    me.law = law
    if law == LINEAR:
        return linear(e_front + e_rear, d_front + d_rear, r)
    if law == SLIDING:
        return sliding(e_front + e_rear, d_front + d_rear, r.max_acceleration_mps2, r)
    if law == FRONT:
        e = e_front if leads else e_front - me.growth
        return follow(me, e, d_front, modified and not leads, log, r)
    if law == REAR:
        e = 0.0 if trails else e_rear + me.growth
        return follow(me, e, d_rear, modified and not trails, log, r)
    if law == HUMAN:
        return drive_by_hand(me, leads, e_front, d_front, episode, r)
    return acceleration


@kernel
def disguised_effort(me: Record, ahead: Record, behind: Record, trails: bool, episode: Record, r: Record) -> float:
    """Effort of the seized vehicle before the attacker takes over: the sliding mode on both sides."""
    e_front, d_front = front_errors(me, ahead, False, 0.0, episode, r)
    e_rear, d_rear = rear_errors(me, behind, trails, r)
    u = sliding(e_front + e_rear, d_front + d_rear, r.max_acceleration_mps2, r)
    return clip((u + episode.drag_per_s * me.speed) / episode.attacker_drive_mps2, r.min_effort, r.max_effort)
