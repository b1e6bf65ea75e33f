"""A follower with few numbers, which corrects every intact vehicle at every decision.

It wants the acceleration a* = gap e + closing r + predecessor a_p, where e is the gap beyond the wanted one, r the
predecessor's speed minus the own, and a_p its acceleration, and commands u = a* + lead (a* - a): the actuator lags by
tau, and with the lead the vehicle follows a* sooner. Without it, 18.1 points become 23 in preset `learning`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, clip, inlined, kernel, lend, record_type, unpack
from cps_envs.core.types import Array, FloatArray, Observation

REACH_M = 10.0  # m, to which e is limited, chosen
EXCESS_MPS = 0.5  # chosen, as in `string`: vehicles may catch up
FORGETTING = 0.2  # 1/s, chosen: a record counts 1 / (1 + this * its age)
USUAL_S, LONGEST_S = 1.0, 5.0  # chosen: silence that lost messages explain, and beyond which it counts no more
HALF = 0.5  # of an entry that is 0 or 1


class SetPoints(NamedTuple):
    """The numbers of one class of vehicles, platoon leaders or others."""

    gap: float  # 1/s2, a* per metre of gap beyond the wanted one
    wanted_m: float  # m, the wanted gap at rest
    headway_s: float  # s, what it grows by with the own speed
    closing: float  # 1/s, a* per m/s that the predecessor is faster
    predecessor: float  # a* per acceleration of the predecessor
    lead: float  # u per acceleration that is missing to a*
    ahead_closing: float  # 1/s, a* per m/s that the disbanded vehicle in the record is faster
    ahead_command: float  # a* per command of that vehicle
    cap: float  # 1/s, u is at most this times the speed that is missing to the desired one, plus 0.5 m/s
    law: float  # share of the plain law's command that is added
    silence: float  # 1/s, a* is less by this per second that a radio link ahead has been silent, see `silent_s`


# All chosen. The plain follower: gains of a textbook, leaders keep 0.2 s more.
LEADERS = SetPoints(0.1, 10.0, 0.2, 1.2, 0.8, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
OTHERS = LEADERS._replace(headway_s=0.0)
UNIT = SetPoints(0.06, 4.0, 0.2, 0.6, 0.3, 0.4, 0.3, 0.3, 0.4, 0.4, 0.2)  # what an agent moves easily
LOWEST = SetPoints(0.0, -5.0, -0.2, 0.0, -1.0, 0.0, -1.0, -1.0, 0.1, -1.0, 0.0)
PLAIN: FloatArray = np.array([LEADERS, OTHERS])  # (2, 11)
NUMBERS = PLAIN.size


class Layout(NamedTuple):
    """How an observation of the defender is to be read."""

    offsets: Array  # (1,) see `Fields.offsets`
    scale: FloatArray  # (2, size) see `Fields.scale`


def set_points(actions: Array, steps: float, neutral: FloatArray = PLAIN) -> Array:
    """Records (2 n,), leaders' and others' by turns, for n actions (..., 22) in [-1, 1].

    0 is `neutral`, (2, 11) or (..., 2, 11), and 1 means so many `UNIT`s more.
    """
    values = neutral + steps * np.reshape(actions, (*actions.shape[:-1], *PLAIN.shape)) * np.array(UNIT)
    table: Array = np.maximum(values, np.array(LOWEST)).reshape(-1, len(UNIT)).view(record_type(SetPoints))[:, 0]
    return table


@inlined
def decoded(row: Observation, scale: FloatArray, entry: int) -> float:
    """An entry of an observation in its unit."""
    return float(row[entry] * scale[1, entry] + scale[0, entry])


@inlined
def count_present(row: Observation, at: Record, scale: FloatArray) -> int:
    """How many platoons there are: all, unless their number is drawn and seen."""
    count = 0
    for entry in range(at.present, at.time_s):
        count += decoded(row, scale, entry) > HALF
    return count


@kernel
def follow_all(
    observation: Observation,
    layout: Layout,
    numbers: Array,
    vehicles_per_platoon: int,
    desired_speed_mps: float,
    limit_mps2: float,
    actions: FloatArray,
) -> None:
    """Write the defender's actions (B, M), corrections as shares of `limit_mps2`.

    `numbers` are records of `SetPoints`, (B N 2,) or (B 2,): for each platoon, or for all of an episode.
    """
    size = vehicles_per_platoon
    sets = numbers.size // (2 * actions.shape[0])  # of an episode
    for b in range(actions.shape[0]):
        row, seen = borrowed(observation)[b], lend(layout)
        at, scale, vehicles = seen.offsets[0], seen.scale, actions.shape[1]
        first, silent = vehicles - (at.warned - at.mitigable), 0.0
        for q in range(max(first, 1), vehicles):
            if q % size == 0:
                silent = max(silent, silent_s(row, seen, q, size))
            actions[b, q] = 0.0
            if decoded(row, scale, at.mitigable + q - first) > HALF:
                chosen = b * sets + min(q // size, sets - 1)
                g = unpack(SetPoints, numbers, 2 * chosen + (q % size > 0))
                u = follow(row, seen, q, size, g, desired_speed_mps, silent)
                correction = u - (1.0 - g.law) * decoded(row, scale, at.law_command + q)
                actions[b, q] = clip(correction / limit_mps2, -1.0, 1.0)


@inlined
def follow(
    row: Observation, layout: Layout, q: int, size: int, g: SetPoints, desired_speed_mps: float, silent: float
) -> float:
    """The command (m/s2) of vehicle `q` >= 1 with the numbers `g`, without the law's share; see `silent_s`."""
    at, scale = layout.offsets[0], layout.scale
    speed = decoded(row, scale, at.speed + q)
    excess = decoded(row, scale, at.gap + q - 1) - g.wanted_m - g.headway_s * speed
    wanted = g.gap * clip(excess, -REACH_M, REACH_M) + g.closing * decoded(row, scale, at.relative_speed + q - 1)
    wanted += g.predecessor * decoded(row, scale, at.acceleration + q - 1)
    place, age_s = find_record(row, layout, q, size)
    if place >= 0:
        told = g.ahead_closing * (decoded(row, scale, at.ahead_speed + place) - speed)
        told += g.ahead_command * decoded(row, scale, at.ahead_command + place)
        wanted += told / (1.0 + FORGETTING * age_s)
    wanted -= g.silence * (clip(silent, USUAL_S, LONGEST_S) - USUAL_S)
    wanted += g.lead * (wanted - decoded(row, scale, at.acceleration + q))
    return min(wanted, g.cap * (desired_speed_mps + EXCESS_MPS - speed))


@inlined
def silent_s(row: Observation, layout: Layout, q: int, size: int) -> float:
    """For how long (s) leader `q` has heard nothing of the vehicle ahead; 0 where no radio is modelled."""
    at = layout.offsets[0]
    if q < size or at.disbanded == at.silence_s:
        return 0.0
    return decoded(row, layout.scale, at.silence_s + q - size)


@inlined
def find_record(row: Observation, layout: Layout, q: int, size: int) -> tuple[int, float]:
    """Where the fields `ahead_*` tell vehicle `q` of a disbanded one, -1 if they do not, and how old (s) that is."""
    at, scale = layout.offsets[0], layout.scale
    if at.record_age_s > at.warned:  # each vehicle has a record of its own
        i = q - size
        warned = i >= 0 and decoded(row, scale, at.warned + max(i, 0)) > HALF
        return (i, decoded(row, scale, at.record_age_s + i)) if warned else (-1, 0.0)
    platoons = count_present(row, at, scale) if at.time_s > at.present else at.ahead_speed - at.disbanded
    mine = platoons - 1 - q // size  # the row of the vehicle's platoon
    for i in range(mine + 1, platoons):
        if decoded(row, scale, at.disbanded + i) > HALF:
            return mine, 0.0
    return -1, 0.0
