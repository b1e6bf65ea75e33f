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
from cps_envs.rogue.detector import NOBODY, capability, listen, raise_alarm
from cps_envs.rogue.formation import formation_cost, reference_position
from cps_envs.rogue.state import Drawn, Rules, Scratch, Side, State


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
    receive(episode, scratch, orders, accelerations, c, r)
    for _ in range(periods):
        hold(episode, attack, c, r)
        for _ in range(r.steps_per_period):
            integrate(episode, scratch, score, c, r)
        score.formation_cost_s += formation_cost(episode, c, r) * r.steps_per_period * r.dt_s


@inlined
def receive(episode: State, scratch: Scratch, orders: IntArray, accelerations: FloatArray, c: Drawn, r: Rules) -> None:
    """Note for each vehicle what the defender orders.

    Until its onset a seized vehicle that gets no orders drives by the sliding mode, and a hidden one obeys.
    """
    for i in range(episode.speed.size):
        k = i - (i > c.attacker and not r.hidden)
        if i == c.attacker and not r.hidden:
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
    """One integration step of all: sense, watch, decide; then move; then touch."""
    grows = episode.step[0] % r.growth_steps == 0
    behind, own = NOBODY, capability(episode, 0, c, r)
    rear = Side(0.0, 0.0, 0.0)
    for i in range(episode.speed.size):
        front, ahead = rear, own
        if i + 1 < episode.speed.size:
            front, ahead = sense(episode, i, r), capability(episode, i + 1, c, r)
        else:
            front = sense_reference(episode, i, c, r)
        if i != c.attacker or r.hidden:
            listen(episode, i, front, rear, ahead, behind, r)
            raise_alarm(episode, i, scratch, score, c, r)
        scratch.command[i] = decide(episode, i, front, rear, scratch, grows, c, r)
        rear, behind, own = front, own, ahead
    for i in range(c.attacker):
        actuate(episode, i, scratch, c.drive_mps2, c, r)
    if episode.step[0] < c.onset_step:
        actuate(episode, c.attacker, scratch, c.drive_mps2 if r.hidden else c.attacker_drive_mps2, c, r)
    else:
        episode.effort[c.attacker] = episode.held_effort[0]
        move(episode, c.attacker, c.attacker_drive_mps2, c, r)
    for i in range(c.attacker + 1, episode.speed.size):
        actuate(episode, i, scratch, c.drive_mps2, c, r)
    settle(episode, score, r)
    episode.step[0] += 1


@inlined
def sense(episode: State, i: int, r: Rules) -> Side:
    """The errors of vehicle `i` to the one ahead. Those of that one to vehicle `i` are the same with opposite signs."""
    error = episode.position[i + 1] - episode.position[i] - r.separation_m
    rate = episode.speed[i + 1] - episode.speed[i]
    return Side(error, rate, sliding(error, rate, r.max_acceleration_mps2, r))


@inlined
def sense_reference(episode: State, leader: int, c: Drawn, r: Rules) -> Side:
    """The errors of the leader to its reference, which keeps no separation."""
    error = reference_position(episode, c, r) - episode.position[leader]
    return Side(error, c.reference_speed_mps - episode.speed[leader], 0.0)


@inlined
def decide(episode: State, i: int, front: Side, rear: Side, scratch: Scratch, grows: bool, c: Drawn, r: Rules) -> float:
    """The desired acceleration (m/s2) of vehicle `i` in this step; `grows`: separations may grow in it."""
    controller = episode.controller[i]
    if controller == LINEAR:
        return linear(front.error - rear.error, front.rate - rear.rate, r)
    if controller == SLIDING:
        return sliding(front.error - rear.error, front.rate - rear.rate, r.max_acceleration_mps2, r)
    modified, leads, trails = scratch.modified[i] == 1, i + 1 == episode.speed.size, i == 0
    if controller == FRONT:
        error = front.error if leads else front.error - episode.growth[i]
        return follow(episode, i, error, front.rate, modified and not leads, grows, r)
    if controller == REAR:
        error = 0.0 if trails else -rear.error + episode.growth[i]
        return follow(episode, i, error, -rear.rate, modified and not trails, grows, r)
    if controller == HUMAN:
        return drive_by_hand(episode, i, front.error, front.rate, c, r)
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
