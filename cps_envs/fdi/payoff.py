"""What is measured and charged in an episode, and the payoff."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from cps_envs.core.compute.kernels import inlined, least
from cps_envs.core.declare.measures import Measure
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.state import Constants, State


class Metrics(NamedTuple):
    """What is measured in an episode so far; marks are 0 or 1."""

    impact_speed_mps: Annotated[
        float, Measure("m/s", "the attacker's reward at the end: impact of the target pair, or of any pair")
    ]
    alarm_cost_mps: Annotated[float, Measure("m/s", "paid for replaced readings")]
    correction_cost_mps: Annotated[float, Measure("m/s", "paid for corrections")]
    worst_impact_mps: Annotated[float, Measure("m/s", "fastest collision of any pair")]
    collided_target: Annotated[float, Measure("", "1 when the target hit the vehicle ahead")]
    collided_pairs: Annotated[float, Measure("", "pairs that collided in the last step")]
    illegal: Annotated[
        float, Measure("", "1 when an illegal injection, or a state without a legal one, ended the episode")
    ]
    time_s: Annotated[float, Measure("s", "since the start")]
    injected_share: Annotated[float, Measure("", "share of all readings that were falsified")]
    replaced_share: Annotated[float, Measure("", "share of all readings that the defender replaced")]
    false_alarm_rate: Annotated[float, Measure("", "share of the readings without injection that were replaced")]
    bound_valid: Annotated[
        float, Measure("", "1 while oracle_bound_mps bounds what any attacker can be paid in this episode")
    ]
    oracle_bound_mps: Annotated[
        float, Measure("m/s", "certified upper bound of the task; 0, and not valid, where none is known")
    ]
    oracle_value_mps: Annotated[float, Measure("m/s", "speed that a known legal plan attains; 0 where none is known")]
    error_growth_m: Annotated[
        float, Measure("m", "growth of error_size_m since the start, paid with goal = instability")
    ]
    error_size_m: Annotated[
        float, Measure("m", "(3.20): size of the errors of the target pair or of all pairs, with P = 1 and 1 s2")
    ]
    attacked: Annotated[float, Measure("", "1 where injections work at some time")]
    smallest_gap_m: Annotated[float, Measure("m", "of any pair")]
    detected: Annotated[float, Measure("", "1 when an attacked reading had been replaced long enough for an alarm")]
    false_alarm: Annotated[float, Measure("", "1 when any other reading had")]


PAID = Metrics._fields[:3]
OF_INSTABILITY = ("error_growth_m", "error_size_m")  # measured with that goal only
PAID_FOR_INSTABILITY = ("error_growth_m", *PAID[1:])
OF_DUELS = Metrics._fields[-4:]  # measured with a filter only


@inlined
def settle(episode: State, c: Constants, target: int, correction: FloatArray, table: Array, payoff: FloatArray) -> bool:
    """Book a step that has been made; returns whether it ended in a collision.

    `correction` (n,) is what the defender asked for, m/s2; `table` (1,) holds the episode's `Metrics`, and what the
    step pays the attacker is added to `payoff` (1,).
    """
    row = table[0]
    row.time_s = episode.step[0] * c.dt_s
    paid = paid_so_far(c, table)
    charge(episode, c, correction, table)
    collided = collide(episode.error, c, target, table)
    if c.pays_growth:
        size_m = size_of(episode.error, c, target)
        row.error_growth_m += size_m - row.error_size_m
        row.error_size_m = size_m
    payoff[0] += paid_so_far(c, table) - paid
    return collided


@inlined
def paid_so_far(c: Constants, table: Array) -> float:
    """What the attacker has been paid in an episode, whose `Metrics` are `table` (1,)."""
    row = table[0]
    reached = row.error_growth_m if c.pays_growth else row.impact_speed_mps
    return float(reached + row.alarm_cost_mps + row.correction_cost_mps)


@inlined
def size_of(error: FloatArray, c: Constants, target: int) -> float:
    """The root of the Lyapunov function (3.20) with P = 1 and 1 s2, in m, of the target pair or of all pairs."""
    n, total = error.size // 2, 0.0
    for i in range(n):
        if c.pays_any or i == target:
            total += error[i] * error[i] + error[n + i] * error[n + i]
    return math.sqrt(total)


@inlined
def charge(episode: State, c: Constants, correction: FloatArray, table: Array) -> None:
    """Book what the defender did in this step, and how often without reason."""
    n, row, tally = correction.size, table[0], episode.tally[0]
    for j in range(episode.trust.size):
        injected, replaced = episode.injection[j] != 0, episode.trust[j] == 0
        tally.injected += injected
        if replaced:
            tally.replaced += 1
            tally.replaced_in_vain += not injected
            row.alarm_cost_mps += c.alarm_cost_mps2 * c.dt_s
            row.bound_valid = 0.0
    for i in range(n):
        if correction[i] != 0:
            row.correction_cost_mps += c.correction_cost * c.dt_s * abs(correction[i]) / n
            row.bound_valid = 0.0
    readings = episode.trust.size * episode.step[0]
    row.injected_share = tally.injected / readings
    row.replaced_share = tally.replaced / readings
    row.false_alarm_rate = tally.replaced_in_vain / max(readings - tally.injected, 1)


@inlined
def open_metrics(episode: State, c: Constants, target: int, table: Array) -> None:
    """Book how an episode begins."""
    row = table[0]
    row.error_size_m = size_of(episode.error, c, target)
    row.attacked = 1.0 if episode.onset[0] < c.horizon else 0.0
    row.smallest_gap_m = c.desired_gap_m + least(episode.error[: episode.command.size])


@inlined
def watch(episode: State, c: Constants, slot: IntArray, table: Array) -> None:
    """Book alarms, on attacked sensors or in vain, and the smallest gap; `slot` (R,) is -1 where nobody attacks."""
    row, working = table[0], episode.step[0] > episode.onset[0]  # in the step that has just been made
    for j in range(episode.trust.size):
        episode.doubted[j] = episode.doubted[j] + 1 if episode.trust[j] == 0 else 0
        if episode.doubted[j] >= c.alarm_steps:
            if slot[j] >= 0 and working:
                row.detected = 1.0
            else:
                row.false_alarm = 1.0
    for i in range(episode.command.size):
        row.smallest_gap_m = min(row.smallest_gap_m, episode.error[i] + c.desired_gap_m)


@inlined
def collide(error: FloatArray, c: Constants, target: int, table: Array) -> bool:
    """Book the collisions at this sample; returns whether there was one."""
    n, row = error.size // 2, table[0]
    pairs, worst = 0, 0.0
    for i in range(n):
        if error[i] <= -c.desired_gap_m + SLACK:
            pairs += 1
            worst = max(worst, -error[n + i])
            if i == target:
                row.collided_target = 1.0
                row.impact_speed_mps = max(0.0, -error[n + i])
    row.collided_pairs, row.worst_impact_mps = pairs, worst
    if c.pays_any:
        row.impact_speed_mps = worst
    return pairs > 0
