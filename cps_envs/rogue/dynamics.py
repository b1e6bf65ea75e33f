"""The closed loop of a platoon, integration step by integration step, in the order of section 2 of the specification.

Within a step all vehicles decide from the state at its start, then all move, then contacts are settled. Platoons of
one size move side by side, see `lanes`.
"""

from __future__ import annotations

from math import inf

from cps_envs.core.compute.kernels import borrowed, clip, inlined, unpack
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.rogue.contact import touch
from cps_envs.rogue.controllers import (
    COMMANDED,
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
from cps_envs.rogue.detector import leaky, raise_alarm
from cps_envs.rogue.formation import formation_cost
from cps_envs.rogue.lanes import Block, Plants, lane
from cps_envs.rogue.state import Drawn, Rules, State, touching_m


@inlined
def advance_lanes(
    block: Block,
    plants: Plants,
    state: State,
    drawn: Array,
    scores: Array,
    rows: IntArray,
    attack: FloatArray,
    leader_mps: FloatArray,
    periods: int,
    n: int,
    width: int,
    r: Rules,
) -> None:
    """Advance the environments `rows`, of n vehicles each, by game steps under held actions, see `game.step`.

    Each has a lane, the first of `width`; further ones repeat the last one.
    """
    count = rows.size
    for _ in range(periods):
        if r.cycles:
            for k in range(count):
                steer(block, plants, leader_mps, state.place[rows[k]], k, r)
        for k in range(count):
            hold(block, plants, borrowed(attack)[rows[k]], k, n, r)
        for _ in range(r.steps_per_period):
            sense(block, plants, n, width, r)
            watch(block, plants, n, width, r)
            if any_marked(block, width):
                raise_alarms(block, state, drawn, scores, rows, n, count, r)
            decide(block, plants, n, width, r)
            for k in range(count):
                if block.particular[k]:
                    decide_apart(block, state, drawn, rows[k], k, n, r)
            actuate(block, plants, n, width, r)
            look_for_contacts(block, plants, n, width)
            if any_marked(block, width):
                settle(block, state, scores, rows, n, count, r)
            for k in range(width):
                block.step[k] += 1
            if r.cycles:
                lead(block, plants, width, r)
        if r.cycles:
            for k in range(count):
                own = borrowed(drawn)[rows[k]]
                own.reference_start_m = plants.reference_start_m[k]
                own.reference_speed_mps = plants.reference_speed_mps[k]
        for k in range(count):
            c, score = unpack(Drawn, drawn, rows[k]), borrowed(scores)[rows[k]]
            cost = formation_cost(lane(block, state, rows[k], k, n), c, r)
            score.formation_cost_s += cost * r.steps_per_period * r.dt_s


@inlined
def steer(block: Block, plants: Plants, leader_mps: FloatArray, place: int, k: int, r: Rules) -> None:
    """Have the reference of lane k reach the next sample of the series (K,) at the end of this period."""
    period = place + block.step[k] // r.steps_per_period
    reached = leader_mps[min(period + 1, leader_mps.size - 1)]
    plants.reference_mps2[k] = (reached - plants.reference_speed_mps[k]) / (r.steps_per_period * r.dt_s)


@inlined
def lead(block: Block, plants: Plants, width: int, r: Rules) -> None:
    """Move the references on by the step that is done, semi-implicitly like the vehicles."""
    for k in range(width):
        time_s, speed = block.step[k] * r.dt_s, plants.reference_speed_mps[k]
        faster = max(0.0, speed + r.dt_s * plants.reference_mps2[k])
        reference = plants.reference_start_m[k] + speed * (time_s - r.dt_s) + faster * r.dt_s
        plants.reference_speed_mps[k] = faster
        plants.reference_start_m[k] = reference - faster * time_s


@inlined
def receive(
    block: Block, state: State, orders: IntArray, accelerations: FloatArray, b: int, k: int, n: int, c: Drawn, r: Rules
) -> None:
    """Note for each vehicle of lane k what the defender orders, (k, 2) and (k,) m/s2.

    Until its onset a seized vehicle that gets no orders drives by the sliding mode, and a hidden one obeys.
    """
    j = -1
    for i in range(n):
        deaf = state.rogue[b, i] and not r.hidden
        j += not deaf
        ordered = SLIDING if deaf else orders[j, 0]
        block.ordered[i, k] = ordered
        block.modified[i, k] = 0 if deaf else orders[j, 1]
        block.wanted[i, k] = 0.0 if deaf else accelerations[j]
        block.limit[i, k] = inf if deaf or state.alarm[b, i] != 0 else r.alarm_threshold
        state.controller[b, i] = block.controller[i, k] = in_force(ordered, state.alarm[b, i])
    look_apart(block, k, n)


@inlined
def look_apart(block: Block, k: int, n: int) -> None:
    """Note whether a vehicle of lane k drives by a controller that `decide` does not know."""
    block.particular[k] = False
    for i in range(n):
        controller = block.controller[i, k]
        block.particular[k] |= controller in (FRONT, REAR, HUMAN)


@inlined
def hold(block: Block, plants: Plants, attack: FloatArray, k: int, n: int, r: Rules) -> None:
    """Set the efforts of the seized vehicles anew by actions (seats,), where a decision of the attacker is due."""
    if block.step[k] % r.hold_steps == 0:
        seat = 0
        for i in range(n):
            if block.rogue[i, k]:
                j = min(i, plants.drag_per_s.shape[0] - 1)
                drag = plants.drag_per_s[j, k] * block.speed[i, k]
                cruise = clip(drag / plants.attacker_drive_mps2[j, k], r.min_effort, r.max_effort)
                block.held_effort[i, k] = effort_of(attack[seat], cruise, r)
                seat += 1


@inlined
def effort_of(action: float, cruise: float, r: Rules) -> float:
    """The attacker's effort: from F- (action -1) over `cruise`, which keeps its speed (0), to F+ (1)."""
    reach = r.max_effort - cruise if action > 0.0 else cruise - r.min_effort
    return cruise + action * reach


@inlined
def any_marked(block: Block, width: int) -> bool:
    """Whether something rare happens in some lane."""
    found = False
    for k in range(width):
        found |= block.marked[k]
    return found


@inlined
def sense(block: Block, plants: Plants, n: int, width: int, r: Rules) -> None:
    """The errors of each vehicle to the one ahead, and of the leader to its reference, which keeps no separation.

    Those of a vehicle to the one behind it are the same with opposite signs. Also what intact vehicles could do at
    their speed; nobody drives in reverse.
    """
    last = plants.drive_mps2.shape[0] - 1  # 0 where all vehicles are alike
    for i in range(n):
        j = min(i, last)
        for k in range(width):
            drag = plants.drag_per_s[j, k] * block.speed[i, k]
            braking = plants.drive_mps2[j, k] * r.min_effort - drag
            block.least[i, k] = braking if block.speed[i, k] > 0.0 else 0.0
            block.most[i, k] = plants.drive_mps2[j, k] * r.max_effort - drag
    for i in range(n - 1):
        for k in range(width):
            error = block.position[i + 1, k] - block.position[i, k] - r.separation_m
            rate = block.speed[i + 1, k] - block.speed[i, k]
            block.error[i + 1, k], block.rate[i + 1, k] = error, rate
            block.closing[i + 1, k] = sliding(error, rate, r.max_acceleration_mps2, r)
    for k in range(width):
        reference = plants.reference_start_m[k] + plants.reference_speed_mps[k] * block.step[k] * r.dt_s
        block.error[n, k] = reference - block.position[n - 1, k]
        block.rate[n, k] = plants.reference_speed_mps[k] - block.speed[n - 1, k]


@inlined
def watch(block: Block, plants: Plants, n: int, width: int, r: Rules) -> None:
    """Both detectors of each vehicle after a step, see `detector`; mark lanes where one has passed its limit.

    The residual is what the neighbour did in the last step beyond closing the error between the two by the sliding mode
    within the limits of an intact vehicle. The two vehicles of a pair see its errors with opposite signs.
    """
    for i in range(n - 1):
        for k in range(width):
            did, could = block.acceleration[i + 1, k], -block.closing[i + 1, k]
            z = leaky(block.front_detector[i, k], did - clip(could, block.least[i + 1, k], block.most[i + 1, k]), r)
            block.front_detector[i, k] = z if r.hidden or not block.rogue[i, k] else block.front_detector[i, k]
        for k in range(width):
            did, could = block.acceleration[i, k], block.closing[i + 1, k]
            z = leaky(block.rear_detector[i + 1, k], did - clip(could, block.least[i, k], block.most[i, k]), r)
            block.rear_detector[i + 1, k] = (
                z if r.hidden or not block.rogue[i + 1, k] else block.rear_detector[i + 1, k]
            )
    for k in range(width):
        block.marked[k] = False
    for i in range(n):
        for k in range(width):
            block.marked[k] |= max(block.front_detector[i, k], block.rear_detector[i, k]) > block.limit[i, k]


@inlined
def raise_alarms(
    block: Block, state: State, drawn: Array, scores: Array, rows: IntArray, n: int, count: int, r: Rules
) -> None:
    """Latch the alarms of the marked lanes."""
    for k in range(count):
        if block.marked[k]:
            c, episode = unpack(Drawn, drawn, rows[k]), lane(block, state, rows[k], k, n)
            for i in range(n):
                if block.limit[i, k] < inf:
                    raise_alarm(episode, i, block.ordered[i, k], borrowed(scores)[rows[k]], c, r)
                    block.controller[i, k] = episode.controller[i]
                    block.limit[i, k] = inf if episode.alarm[i] != 0 else r.alarm_threshold
            look_apart(block, k, n)


@inlined
def decide(block: Block, plants: Plants, n: int, width: int, r: Rules) -> None:
    """The desired accelerations (m/s2) in this step, but for the controllers of `decide_apart`."""
    last = plants.proportional_gain.shape[0] - 1
    for i in range(n):
        j = min(i, last)
        for k in range(width):
            e, d = block.error[i + 1, k] - block.error[i, k], block.rate[i + 1, k] - block.rate[i, k]
            proportional = linear(e, d, plants.proportional_gain[j, k], plants.derivative_gain[j, k])
            saturated = sliding(e, d, r.max_acceleration_mps2, r)
            own = proportional if block.controller[i, k] == LINEAR else saturated
            block.command[i, k] = block.wanted[i, k] if block.controller[i, k] == COMMANDED else own


@inlined
def decide_apart(block: Block, state: State, drawn: Array, b: int, k: int, n: int, r: Rules) -> None:
    """The desired accelerations (m/s2) of vehicles of lane k that look at one side only, or are driven by hand."""
    c, episode, grows = unpack(Drawn, drawn, b), lane(block, state, b, k, n), block.step[k] % r.growth_steps == 0
    for i in range(n):
        controller, modified = block.controller[i, k], block.modified[i, k] == 1
        if controller == FRONT:
            leads, error = i + 1 == n, block.error[i + 1, k]
            error = error if leads else error - episode.growth[i]
            block.command[i, k] = follow(episode, i, error, block.rate[i + 1, k], modified and not leads, grows, r)
        elif controller == REAR:
            error = 0.0 if i == 0 else -block.error[i, k] + episode.growth[i]
            block.command[i, k] = follow(episode, i, error, -block.rate[i, k], modified and i > 0, grows, r)
        elif controller == HUMAN:
            block.command[i, k] = drive_by_hand(episode, i, block.error[i + 1, k], block.rate[i + 1, k], c, r)


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
        bumpers_m = e + r.separation_m - touching_m(episode, i)
        return drive_behind(bumpers_m, d, episode.speed[i], c.reference_speed_mps, r)
    return drive_back(e, d) if r.human_returns else drive_freely(episode.speed[i], c.reference_speed_mps, r)


@inlined
def actuate(block: Block, plants: Plants, n: int, width: int, r: Rules) -> None:
    """Move all vehicles with the efforts that make their desired accelerations, as far as their limits allow.

    From the onset on a seized vehicle moves with the attacker's. The plant is (5.5) to (5.7): no reverse,
    semi-implicit Euler.
    """
    for k in range(width):
        block.seized[k] = block.step[k] >= plants.onset_step[k]
    last = plants.drive_mps2.shape[0] - 1
    for i in range(n):
        j = min(i, last)
        for k in range(width):
            rogue, speed = block.rogue[i, k], block.speed[i, k]
            strong, drag = rogue & (block.seized[k] | (not r.hidden)), plants.drag_per_s[j, k] * speed
            drive = plants.attacker_drive_mps2[j, k] if strong else plants.drive_mps2[j, k]
            own = clip((block.command[i, k] + drag) / drive, r.min_effort, r.max_effort)
            effort = block.held_effort[i, k] if rogue & block.seized[k] else own
            block.effort[i, k] = effort
            acceleration = drive * (0.0 if (speed <= 0.0) & (effort < 0.0) else effort) - drag
            faster = max(0.0, speed + r.dt_s * acceleration)
            block.acceleration[i, k], block.speed[i, k] = acceleration, faster
            block.position[i, k] += r.dt_s * faster


@inlined
def look_for_contacts(block: Block, plants: Plants, n: int, width: int) -> None:
    """Mark the lanes where a pair touches, or has touched and is not armed yet."""
    for k in range(width):
        block.marked[k] = False
    last = plants.length_m.shape[0] - 1
    for i in range(n - 1):
        rear, front = min(i, last), min(i + 1, last)
        for k in range(width):
            apart = block.position[i + 1, k] - block.position[i, k]
            gap = apart - 0.5 * (plants.length_m[rear, k] + plants.length_m[front, k])
            block.marked[k] |= (not gap >= 0.0) | (not block.armed[i, k])


@inlined
def settle(block: Block, state: State, scores: Array, rows: IntArray, n: int, count: int, r: Rules) -> None:
    """Account for all contacts of the marked lanes after the motion of a step, from the rear to the leader."""
    for k in range(count):
        if block.marked[k]:
            episode = lane(block, state, rows[k], k, n)
            for i in range(n - 1):
                touch(episode, i, borrowed(scores)[rows[k]], r)
