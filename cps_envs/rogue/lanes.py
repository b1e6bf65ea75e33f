"""Episodes side by side: vehicle by vehicle in lanes, so that one instruction of the processor moves several platoons.

A lane is an episode. Arrays (n, W) hold a vehicle of all lanes next to each other; what happens rarely is done in a
`lane`, where an episode looks as it does everywhere else.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import borrowed, fill, inlined, maker, room, unpack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.state import Drawn, State, platoon

WIDTH = 32  # lanes; fewer leave the processor's vectors unused, more leave its fastest memory
WORTH = 12  # episodes, from which on all lanes together cost less than one episode after the other


class Block(NamedTuple):
    """What changes in every integration step, and what the next one is made from: n vehicles in W lanes."""

    position: FloatArray  # (n, W) m, see `state.State`
    speed: FloatArray  # (n, W) m/s
    acceleration: FloatArray  # (n, W) m/s2
    effort: FloatArray  # (n, W)
    front_detector: FloatArray  # (n, W) m2/s3
    rear_detector: FloatArray  # (n, W) m2/s3
    armed: BoolArray  # (n, W), the last row is not used
    step: IntArray  # (W,)
    held_effort: FloatArray  # (n, W)
    rogue: BoolArray  # (n, W) the seized vehicles
    error: FloatArray  # (n + 1, W) m, of vehicle i to the one ahead in row i + 1; row 0 stays zero
    rate: FloatArray  # (n + 1, W) m/s, likewise
    closing: FloatArray  # (n + 1, W) m/s2, likewise, by which the sliding mode would close the error
    least: FloatArray  # (n, W) m/s2, that an intact vehicle is capable of at its speed
    most: FloatArray  # (n, W) m/s2
    limit: FloatArray  # (n, W) m2/s3, of the detectors; infinite after an alarm
    controller: IntArray  # (n, W), see `controllers`
    wanted: FloatArray  # (n, W) m/s2, of vehicles that are commanded
    command: FloatArray  # (n, W) m/s2, desired, before the limits of the actuator
    ordered: IntArray  # (n, W) controllers that the defender has selected
    modified: IntArray  # (n, W) whether following is modified
    marked: BoolArray  # (W,) lanes where something rare happens in this step
    particular: BoolArray  # (W,) lanes where a vehicle drives by a controller that is rare
    seized: BoolArray  # (W,) whether the attacker drives


class Plants(NamedTuple):
    """What the episodes have drawn and every integration step needs: of vehicles (m, W), see `State`, else (W,)."""

    drive_mps2: FloatArray
    attacker_drive_mps2: FloatArray  # what the attacker gets out of each engine
    drag_per_s: FloatArray
    length_m: FloatArray
    proportional_gain: FloatArray
    derivative_gain: FloatArray
    reference_start_m: FloatArray
    reference_speed_mps: FloatArray
    reference_mps2: FloatArray  # by which the reference speed changes in this period
    onset_step: IntArray


@maker
def make_block(n: int, width: int) -> Block:
    """So many lanes for platoons of up to n vehicles."""
    vehicles, sides = (n, width), (n + 1, width)
    error, rate, closing = room(sides), room(sides), room(sides)
    for values in (error, rate, closing):
        fill(values.reshape(-1), 0.0)
    return Block(
        position=room(vehicles),
        speed=room(vehicles),
        acceleration=room(vehicles),
        effort=room(vehicles),
        front_detector=room(vehicles),
        rear_detector=room(vehicles),
        armed=room(vehicles, np.bool_),
        step=room(width, np.int64),
        held_effort=room(vehicles),
        rogue=room(vehicles, np.bool_),
        error=error,
        rate=rate,
        closing=closing,
        least=room(vehicles),
        most=room(vehicles),
        limit=room(vehicles),
        controller=room(vehicles, np.int64),
        wanted=room(vehicles),
        command=room(vehicles),
        ordered=room(vehicles, np.int64),
        modified=room(vehicles, np.int64),
        marked=room(width, np.bool_),
        particular=room(width, np.bool_),
        seized=room(width, np.bool_),
    )


@maker
def make_plants(m: int, width: int) -> Plants:
    """Plants of so many lanes with m vehicles that differ."""
    bodies, reference_mps2 = (m, width), room(width)
    fill(reference_mps2, 0.0)
    return Plants(
        drive_mps2=room(bodies),
        attacker_drive_mps2=room(bodies),
        drag_per_s=room(bodies),
        length_m=room(bodies),
        proportional_gain=room(bodies),
        derivative_gain=room(bodies),
        reference_start_m=room(width),
        reference_speed_mps=room(width),
        reference_mps2=reference_mps2,
        onset_step=room(width, np.int64),
    )


@inlined
def load(block: Block, plants: Plants, state: State, drawn: Array, b: int, k: int, n: int) -> None:
    """Have lane k begin as environment b, whose platoon has n vehicles."""
    for i in range(n):
        block.position[i, k] = state.position[b, i]
        block.speed[i, k] = state.speed[b, i]
        block.acceleration[i, k] = state.acceleration[b, i]
        block.effort[i, k] = state.effort[b, i]
        block.front_detector[i, k] = state.front_detector[b, i]
        block.rear_detector[i, k] = state.rear_detector[b, i]
        block.held_effort[i, k], block.rogue[i, k] = state.held_effort[b, i], state.rogue[b, i]
    for i in range(n - 1):
        block.armed[i, k] = state.armed[b, i]
    block.step[k] = state.step[b]
    c = unpack(Drawn, drawn, b)
    plants.onset_step[k] = c.onset_step
    for j in range(state.length_m.shape[1]):
        plants.attacker_drive_mps2[j, k] = c.attacker_drive_mps2 * (state.drive_mps2[b, j] / c.drive_mps2)
        plants.drive_mps2[j, k], plants.drag_per_s[j, k] = state.drive_mps2[b, j], state.drag_per_s[b, j]
        plants.length_m[j, k] = state.length_m[b, j]
        plants.proportional_gain[j, k] = state.proportional_gain[b, j]
        plants.derivative_gain[j, k] = state.derivative_gain[b, j]
    plants.reference_start_m[k], plants.reference_speed_mps[k] = c.reference_start_m, c.reference_speed_mps


@inlined
def store(block: Block, state: State, b: int, k: int, n: int) -> None:
    """Have environment b, of n vehicles, go on from lane k."""
    for i in range(n):
        state.position[b, i] = block.position[i, k]
        state.speed[b, i] = block.speed[i, k]
        state.acceleration[b, i] = block.acceleration[i, k]
        state.effort[b, i] = block.effort[i, k]
        state.front_detector[b, i] = block.front_detector[i, k]
        state.rear_detector[b, i] = block.rear_detector[i, k]
        state.held_effort[b, i] = block.held_effort[i, k]
    for i in range(n - 1):
        state.armed[b, i] = block.armed[i, k]
    state.step[b] = block.step[k]


@inlined
def lane(block: Block, state: State, b: int, k: int, n: int) -> State:
    """The episode of environment b, of n vehicles, as it stands in lane k; its arrays are views."""
    kept = platoon(state, b, n)
    return State(
        position=borrowed(block.position)[:n, k],
        speed=borrowed(block.speed)[:n, k],
        acceleration=borrowed(block.acceleration)[:n, k],
        effort=borrowed(block.effort)[:n, k],
        front_detector=borrowed(block.front_detector)[:n, k],
        rear_detector=borrowed(block.rear_detector)[:n, k],
        growth=kept.growth,
        alarm=kept.alarm,
        controller=kept.controller,
        damage=kept.damage,
        collisions=kept.collisions,
        armed=borrowed(block.armed)[: n - 1, k],
        step=borrowed(block.step)[k : k + 1],
        held_effort=borrowed(block.held_effort)[:n, k],
        rogue=kept.rogue,
        drive_mps2=kept.drive_mps2,
        drag_per_s=kept.drag_per_s,
        length_m=kept.length_m,
        proportional_gain=kept.proportional_gain,
        derivative_gain=kept.derivative_gain,
        place=kept.place,
    )
