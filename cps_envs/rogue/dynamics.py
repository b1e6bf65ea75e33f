"""The closed loop of a platoon, integration step by integration step, in the order of section 2 of the specification.

Within a step all vehicles decide from the state at its start, then all move, then contacts are settled.
"""

from __future__ import annotations

from cps_envs.core.kernels import Record, clip, inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.rogue.contact import settle
from cps_envs.rogue.controllers import (
    FRONT,
    HUMAN,
    LINEAR,
    REAR,
    SLIDING,
    drive_back,
    drive_behind,
    drive_freely,
    in_force,
    linear,
    scheduled_authority,
    sliding,
)
from cps_envs.rogue.detector import listen, raise_alarms
from cps_envs.rogue.formation import reference_position, scattering
from cps_envs.rogue.state import Drawn, Rules, Scratch, State


@inlined
def advance_episode(
    episode: State,
    scratch: Scratch,
    attack: float,
    orders: IntArray,
    accelerations: FloatArray,
    periods: int,
    score: Record,
    c: Drawn,
    r: Rules,
) -> None:
    """Advance one episode by game steps under held actions, see `game.step`."""
    receive(episode, scratch, orders, accelerations, c)
    for _ in range(periods):
        hold(episode, attack, c, r)
        for _ in range(r.steps_per_period):
            integrate(episode, scratch, score, c, r)
        score.formation_cost_s += scattering(episode, c, r) * r.steps_per_period * r.dt_s


@inlined
def receive(episode: State, scratch: Scratch, orders: IntArray, accelerations: FloatArray, c: Drawn) -> None:
    """Note for each vehicle what the defender orders; until its onset the seized one drives by the sliding mode."""
    for i in range(episode.speed.size):
        k = i - (i > c.attacker)
        if i == c.attacker:
            scratch.ordered[i], scratch.modified[i], scratch.wanted[i] = SLIDING, 0, 0.0
        else:
            scratch.ordered[i], scratch.modified[i], scratch.wanted[i] = orders[k, 0], orders[k, 1], accelerations[k]
        episode.controller[i] = in_force(scratch.ordered[i], episode.alarm[i])


@inlined
def hold(episode: State, attack: float, c: Drawn, r: Rules) -> None:
    """Set the attacker's effort anew where a decision of the attacker is due."""
    if episode.step[0] % r.hold_steps == 0:
        drag = c.drag_per_s * episode.speed[c.attacker]
        episode.held_effort[0] = effort_of(attack, clip(drag / c.attacker_drive_mps2, r.min_effort, r.max_effort), r)


@inlined
def effort_of(action: float, cruise: float, r: Rules) -> float:
    """The attacker's effort: from F- (action -1) over `cruise`, which keeps its speed (0), to F+ (1)."""
    reach = r.max_effort - cruise if action > 0.0 else cruise - r.min_effort
    return cruise + action * reach


@inlined
def integrate(episode: State, scratch: Scratch, score: Record, c: Drawn, r: Rules) -> None:
    """One integration step of all: sense, watch, decide, move, touch."""
    sense(episode, scratch, c, r)
    listen(episode, scratch, c, r)
    raise_alarms(episode, scratch, score, r)
    grows = episode.step[0] % r.growth_steps == 0
    for i in range(episode.speed.size):
        scratch.command[i] = decide(episode, i, scratch, grows, c, r)
    for i in range(c.attacker):
        actuate(episode, i, scratch, c.drive_mps2, c, r)
    if episode.step[0] < c.onset_step:
        actuate(episode, c.attacker, scratch, c.attacker_drive_mps2, c, r)
    else:
        episode.effort[c.attacker] = episode.held_effort[0]
        move(episode, c.attacker, c.attacker_drive_mps2, c, r)
    for i in range(c.attacker + 1, episode.speed.size):
        actuate(episode, i, scratch, c.drive_mps2, c, r)
    settle(episode, score, r)
    episode.step[0] += 1


@inlined
def sense(episode: State, scratch: Scratch, c: Drawn, r: Rules) -> None:
    """The errors between neighbours, and of the leader to its reference, which keeps no separation."""
    leader = episode.armed.size
    for i in range(leader):
        scratch.error[i + 1] = episode.position[i + 1] - episode.position[i] - r.separation_m
        scratch.rate[i + 1] = episode.speed[i + 1] - episode.speed[i]
    for i in range(leader):
        scratch.closing[i] = sliding(scratch.error[i + 1], scratch.rate[i + 1], r.max_acceleration_mps2, r)
    scratch.error[leader + 1] = reference_position(episode, c, r) - episode.position[leader]
    scratch.rate[leader + 1] = c.reference_speed_mps - episode.speed[leader]


@inlined
def decide(episode: State, i: int, scratch: Scratch, grows: bool, c: Drawn, r: Rules) -> float:
    """The desired acceleration (m/s2) of vehicle `i` in this step; `grows`: separations may grow in it."""
    controller = episode.controller[i]
    e_front, d_front = scratch.error[i + 1], scratch.rate[i + 1]
    e_rear, d_rear = -scratch.error[i], -scratch.rate[i]
    leads, trails = i + 1 == episode.speed.size, i == 0
    if controller == LINEAR:
        return linear(e_front + e_rear, d_front + d_rear, r)
    if controller == SLIDING:
        return sliding(e_front + e_rear, d_front + d_rear, r.max_acceleration_mps2, r)
    modified = scratch.modified[i] == 1
    if controller == FRONT:
        return follow(
            episode, i, e_front if leads else e_front - episode.growth[i], d_front, modified and not leads, grows, r
        )
    if controller == REAR:
        return follow(
            episode, i, 0.0 if trails else e_rear + episode.growth[i], d_rear, modified and not trails, grows, r
        )
    if controller == HUMAN:
        return drive_by_hand(episode, i, e_front, d_front, c, r)
    return float(scratch.wanted[i])


@inlined
def follow(episode: State, i: int, e: float, d: float, modified: bool, grows: bool, r: Rules) -> float:
    """Acceleration (m/s2) of following one side, plainly or modified by (5.12) to (5.14).

    Modified following also grows the separation, with effect from the next step. `e` contains the growth so far.
    """
    if not modified:
        return sliding(e, d, r.max_acceleration_mps2, r)
    if grows and abs(e) < r.inner_share * r.separation_m:
        episode.growth[i] = min(episode.growth[i] + r.growth_step_m, r.max_growth_m)
    return sliding(e, d, scheduled_authority(e, d, r), r)


@inlined
def drive_by_hand(episode: State, i: int, e: float, d: float, c: Drawn, r: Rules) -> float:
    """Acceleration (m/s2) of a human, who ignores what is behind; `e` and `d` are the errors on the front side."""
    if i + 1 < episode.speed.size:
        return drive_behind(e + r.separation_m, d, episode.speed[i], c.reference_speed_mps, r)
    return drive_back(e, d) if r.human_returns else drive_freely(episode.speed[i], c.reference_speed_mps, r)


@inlined
def actuate(episode: State, i: int, scratch: Scratch, drive_mps2: float, c: Drawn, r: Rules) -> None:
    """Move vehicle `i` with the effort that makes its desired acceleration, as far as its limits allow."""
    effort = (scratch.command[i] + c.drag_per_s * episode.speed[i]) / drive_mps2
    episode.effort[i] = clip(effort, r.min_effort, r.max_effort)
    move(episode, i, drive_mps2, c, r)


@inlined
def move(episode: State, i: int, drive_mps2: float, c: Drawn, r: Rules) -> None:
    """The plant (5.5) to (5.7) of one vehicle: no reverse, semi-implicit Euler."""
    standing = (episode.speed[i] <= 0.0) & (episode.effort[i] < 0.0)
    effort = 0.0 if standing else episode.effort[i]
    episode.acceleration[i] = drive_mps2 * effort - c.drag_per_s * episode.speed[i]
    episode.speed[i] = max(0.0, episode.speed[i] + r.dt_s * episode.acceleration[i])
    episode.position[i] += r.dt_s * episode.speed[i]
