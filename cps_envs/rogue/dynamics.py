"""The closed loop of an episode, step by step in the order of section 2 of the specification."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.contact import touch
from cps_envs.rogue.driving import decide, disguised_effort
from cps_envs.rogue.formation import reference_position, scattering
from cps_envs.rogue.kernel import Record, clip, kernel


@kernel
def effort_of(action: float, cruise: float, r: Record) -> float:
    """The attacker's effort: from F- (action -1) over `cruise`, which keeps its speed (0), to F+ (1)."""
    reach = r.max_effort - cruise if action > 0.0 else cruise - r.min_effort
    return float(cruise + action * reach)


@kernel
def hold(action: float, speed: float, episode: Record, log: Record, r: Record) -> None:
    """Set the attacker's effort anew where a decision of the attacker is due."""
    if log.step % r.hold_steps == 0:
        cruise = clip(episode.drag_per_s * speed / episode.attacker_drive_mps2, r.min_effort, r.max_effort)
        log.held_effort = effort_of(action, cruise, r)


@kernel
def move(me: Record, effort: float, drive_mps2: float, drag_per_s: float, dt_s: float) -> None:
    """The plant (5.5) to (5.7) of one vehicle: no reverse, semi-implicit Euler."""
    if me.speed <= 0.0 and effort < 0.0:
        effort = 0.0
    me.acceleration = drive_mps2 * effort - drag_per_s * me.speed
    me.speed = max(0.0, me.speed + dt_s * me.acceleration)
    me.position += dt_s * me.speed


@kernel
def step(
    vehicles: NDArray[np.void],
    pairs: NDArray[np.void],
    episode: Record,
    log: Record,
    orders: NDArray[np.int64],
    accelerations: NDArray[np.float64],
    r: Record,
) -> None:
    """One integration step of all: decide from the state at its start, move, touch."""
    seized, leader, drive, drag = episode.attacker, len(vehicles) - 1, episode.drive_mps2, episode.drag_per_s
    reference_m = reference_position(episode, log, r)
    for i in range(leader + 1):
        me, ahead, behind = vehicles[i], vehicles[min(i + 1, leader)], vehicles[max(i - 1, 0)]
        if i == seized:
            disguised = log.step < episode.onset_step
            log.effort = disguised_effort(me, ahead, behind, i == 0, episode, r) if disguised else log.held_effort
        else:
            k = i if i < seized else i - 1
            order, modified, wanted = orders[k, 0], orders[k, 1] == 1, accelerations[k]
            sides = i == leader, i == 0
            me.command = decide(me, ahead, behind, *sides, order, modified, wanted, reference_m, episode, log, r)
    for i in range(leader + 1):
        me = vehicles[i]
        if i == seized:
            move(me, log.effort, episode.attacker_drive_mps2, drag, r.dt_s)
        else:
            effort = clip((me.command + drag * me.speed) / drive, r.min_effort, r.max_effort)
            move(me, effort, drive, drag, r.dt_s)
    for i in range(leader):
        touch(vehicles[i], vehicles[i + 1], pairs[i], log, r)
    log.step += 1


@kernel
def advance_episode(
    vehicles: NDArray[np.void],
    pairs: NDArray[np.void],
    episode: Record,
    log: Record,
    action: float,
    orders: NDArray[np.int64],
    accelerations: NDArray[np.float64],
    periods: int,
    r: Record,
) -> None:
    """Advance one episode by game steps under held actions, see `turn.take_turn`."""
    for _ in range(periods):
        hold(action, vehicles[episode.attacker].speed, episode, log, r)
        for _ in range(r.steps_per_period):
            step(vehicles, pairs, episode, log, orders, accelerations, r)
        log.formation_cost_s += scattering(vehicles, episode, log, r) * r.steps_per_period * r.dt_s
