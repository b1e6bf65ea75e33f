"""One integration step of an episode in small pieces, and `advance`, the closed loop with a defender's corrections.

An *episode* is one environment's view of a `State`: rows without the axis B, scalars as arrays of length one.
Every closed loop composes the same pieces in the order of section 2.6 of the specification: commands by the platoons'
controllers, mitigation, collision avoidance, integration, accounting.
"""

from __future__ import annotations

import math

from cps_envs.core.compute.kernels import borrowed, clip, inlined, kernel, room, unpack, view
from cps_envs.core.types import Array, BoolArray, FloatArray
from cps_envs.disbanding.controllers import (
    avoidance_margin,
    command_humans,
    command_platoons,
    corrected,
    has_begun,
    look_ahead,
    most_forward_disbanded,
)
from cps_envs.disbanding.drivers import jolt
from cps_envs.disbanding.state import Constants, State

STOP_MPS = 0.01  # a vehicle stops when it gets slower than this
REARM_MPS = 1.0  # a further stop counts once it was faster than this


@inlined
def command_by_law(episode: State, c: Constants, gap: FloatArray, closing: FloatArray, u: FloatArray) -> None:
    """Fill gap (m), closing speed (m/s) and the plain law's command `u` (m/s2) of every vehicle, (2.2) to (2.5)."""
    look_ahead(episode, c.num_vehicles, gap, closing)
    command_platoons(episode, c, gap, closing, u)
    command_humans(episode, c, gap, episode.step[0] * c.dt_s, u)


@inlined
def first_mitigable(episode: State, c: Constants) -> int:
    """The most forward vehicle that may be mitigable now: vehicles from here on are, where their platoon is intact."""
    if c.corrects_all:
        return 0
    size = c.vehicles_per_platoon
    platoons = c.num_vehicles // size
    front = most_forward_disbanded(episode.disbanding_s, platoons, episode.step[0] * c.dt_s)
    return min(front + 1, platoons) * size


@inlined
def correct_commands(episode: State, c: Constants, correction: FloatArray) -> None:
    """Apply the defender's corrections (M,) m/s2 to the commands of the mitigable vehicles by rule (2.7)."""
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    for platoon in range(first_mitigable(episode, c) // size, c.num_vehicles // size):
        if not has_begun(time_s, episode.disbanding_s[platoon]):
            for q in range(platoon * size, (platoon + 1) * size):
                noise, full = episode.noise_mps2[q], c.full_correction_mps2
                episode.command[q] = corrected(episode.command[q], correction[q], noise, full, low, high)


@inlined
def final_command(command: float, gap: float, speed: float, speed_ahead: float, c: Constants) -> float:
    """What the actuator gets (m/s2): saturated where the interpretation has it, then (2.6), which overrides all."""
    low = c.min_acceleration_mps2
    if c.saturate_command:
        command = clip(command, low, c.max_acceleration_mps2)
    margin = avoidance_margin(gap, speed, speed_ahead, c.standstill_gap_m, -low, c.one_sided_avoidance)
    return low if margin <= 0.0 else command


@inlined
def avoid_collisions(episode: State, c: Constants, gap: FloatArray) -> None:
    """Make every command final; the front vehicle has an infinite gap."""
    u, speed = episode.command, episode.speed
    u[0] = final_command(u[0], gap[0], speed[0], speed[0], c)
    for q in range(1, c.num_vehicles):
        u[q] = final_command(u[q], gap[q], speed[q], speed[q - 1], c)


@inlined
def within_speeds(acceleration: float, speed: float, slowest: float, fastest: float) -> float:
    """The acceleration (m/s2), or zero where it points out of a speed limit that `speed` has reached."""
    inward = min(acceleration, 0.0) if speed >= fastest else acceleration
    return max(inward, 0.0) if speed <= slowest else inward


@inlined
def integrate_euler(episode: State, c: Constants) -> None:
    """Explicit Euler step of (2.1) from the old state, then the limits of acceleration and speed."""
    dt, differ = c.dt_s, episode.tau_s.size > 0
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    slowest, fastest = c.min_speed_mps, c.max_speed_mps
    x, v, a, u = episode.position, episode.speed, episode.acceleration, episode.command
    for q in range(c.num_vehicles):
        tau = episode.tau_s[q] if differ else c.tau_s
        speed = v[q] + dt * a[q]
        acceleration = clip(a[q] + dt * (u[q] - a[q]) / tau, low, high)
        x[q] += dt * v[q]
        v[q] = clip(speed, slowest, fastest)
        a[q] = within_speeds(acceleration, speed, slowest, fastest)


@inlined
def integrate_exactly(episode: State, c: Constants) -> None:
    """Exact step of (2.1) with the command held; a vehicle that reaches its lowest speed does not move backward."""
    dt, differ, tau = c.dt_s, episode.tau_s.size > 0, c.tau_s
    decay = math.exp(-dt / tau)
    slowest, fastest = c.min_speed_mps, c.max_speed_mps
    x, v, a, u = episode.position, episode.speed, episode.acceleration, episode.command
    for q in range(c.num_vehicles):
        if differ:
            tau = episode.tau_s[q]
            decay = math.exp(-dt / tau)
        lag = a[q] - u[q]
        position = x[q] + v[q] * dt + 0.5 * u[q] * dt * dt + lag * tau * (dt - tau * (1.0 - decay))
        speed = v[q] + u[q] * dt + lag * tau * (1.0 - decay)
        x[q] = position if speed > slowest else max(position, x[q])
        v[q] = clip(speed, slowest, fastest)
        a[q] = within_speeds(u[q] + lag * decay, speed, slowest, fastest)


@inlined
def keep_order(episode: State, c: Constants) -> None:
    """Inelastic contact, front to rear: who touches its predecessor stays behind it and is not faster."""
    x, v, a = episode.position, episode.speed, episode.acceleration
    for q in range(1, c.num_vehicles):
        if x[q - 1] - x[q] <= 0.0:
            x[q] = x[q - 1]
            if v[q] > v[q - 1]:
                v[q] = v[q - 1]
                a[q] = min(a[q], a[q - 1])


@inlined
def stand_still(episode: State, c: Constants) -> None:
    """The rule after (2.5): who is nearer than r_0 to the vehicle ahead cannot move, and stands from one step on."""
    x = episode.position
    for q in range(1, c.num_vehicles):
        if x[q - 1] - x[q] < c.standstill_gap_m:
            episode.speed[q] = episode.acceleration[q] = 0.0


@inlined
def integrate(episode: State, c: Constants) -> None:
    """Move every vehicle by one step under its final command, and mark who touches whom."""
    if c.exact_integration:
        integrate_exactly(episode, c)
    else:
        integrate_euler(episode, c)
    mark_collisions(episode, c)
    if c.inelastic_contact:
        keep_order(episode, c)
    if c.standstill_rule:
        stand_still(episode, c)


@inlined
def mark_collisions(episode: State, c: Constants) -> None:
    """Note the vehicles whose gap ahead is <= 0 after the step, and their predecessors."""
    x = episode.position
    touching = 0
    for q in range(1, c.num_vehicles):
        touching += x[q - 1] - x[q] <= 0.0
    if touching == 0:
        return
    for q in range(1, c.num_vehicles):
        if x[q - 1] - x[q] <= 0.0 and not episode.rear_collided[q]:
            episode.rear_collided[q] = True
            involve(episode, c, q)
            involve(episode, c, q - 1)
            if episode.first_collision_s[0] < 0.0:
                episode.first_collision_s[0] = (episode.step[0] + 1) * c.dt_s


@inlined
def involve(episode: State, c: Constants, q: int) -> None:
    """Mark vehicle `q` as involved in a collision, and whether its platoon was intact when that happened."""
    if not episode.collided[q]:
        episode.collided[q] = True
        disbanding_s = episode.disbanding_s[q // c.vehicles_per_platoon]
        episode.collided_intact[q] = not has_begun(episode.step[0] * c.dt_s, disbanding_s)


@inlined
def add_speed_errors(episode: State, c: Constants) -> None:
    """Add the speed errors of (2.8) after the step: per vehicle, and their mean over the vehicles intact now."""
    speed, desired_speed, size = episode.speed, c.desired_speed_mps, c.vehicles_per_platoon
    time_s = episode.step[0] * c.dt_s
    for q in range(c.num_vehicles):
        episode.speed_error[q] += abs(speed[q] - desired_speed)
    intact, total = 0, 0.0
    for platoon in range(c.num_vehicles // size):
        if not has_begun(time_s, episode.disbanding_s[platoon]):
            platoon_error = 0.0
            for q in range(platoon * size, (platoon + 1) * size):
                platoon_error += abs(speed[q] - desired_speed)
            intact += size
            total += platoon_error
    if intact > 0:
        episode.intact_error[0] += total / intact


@inlined
def count_stops(episode: State, c: Constants) -> None:
    """Count the vehicles that came to a stop in this step; bitwise logic, as branches cost more than the rest."""
    speed, moving, stops = episode.speed, episode.moving, episode.stops
    for q in range(c.num_vehicles):
        still = speed[q] < STOP_MPS
        stops[q] += still & moving[q]
        moving[q] = (speed[q] > REARM_MPS) | (moving[q] & (not still))


@inlined
def account(episode: State, c: Constants) -> None:
    """Everything that is counted after a step: collisions are marked by `integrate`; then the clock moves on."""
    add_speed_errors(episode, c)
    count_stops(episode, c)
    episode.step[0] += 1


@inlined
def has_ended(episode: State, c: Constants) -> bool:
    """Whether the episode stands still because an intact vehicle has collided and its constants say so."""
    ended = False
    if c.stop_at_collision:
        for q in range(c.num_vehicles):
            ended = ended or bool(episode.collided_intact[q])
    return ended


@inlined
def advance_episode(episode: State, c: Constants, correction: FloatArray, closing: FloatArray, num_steps: int) -> None:
    """`advance` for one episode; `correction` (M,) m/s2, `closing` (M,) is room to work in.

    It allocates nothing, so that a thread of a GPU can run it, too.
    """
    gap = episode.previous_gap  # what is computed at a step is the gap before the next one
    for _ in range(num_steps):
        if has_ended(episode, c):
            return
        command_by_law(episode, c, gap, closing, episode.command)
        correct_commands(episode, c, correction)
        if episode.jolted_until_s.size > 0:
            jolt(episode, c)
        avoid_collisions(episode, c, gap)
        integrate(episode, c)
        account(episode, c)


@kernel
def advance(state: State, constants: Array, correction: FloatArray, envs: BoolArray, num_steps: int) -> None:
    """Advance the marked environments (B,) in place by `num_steps` integration steps, holding the corrections.

    `constants` (B,) records of `Constants`; `correction` (B, M) m/s2.
    """
    closing = room(correction.shape[1])
    for b in range(envs.size):
        if envs[b]:
            episode, c = view(state, b), unpack(Constants, constants, b)
            advance_episode(episode, c, borrowed(correction)[b], closing, num_steps)
