"""The attacker's moves, at whole seconds: disbanding one of the paper's platoons 1..N, blocking a radio link."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import BoolArray, IntArray
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.drivers import begin_jolt
from cps_envs.disbanding.radio import take_record
from cps_envs.disbanding.state import Constants, State

EARLIEST_S = 1.0  # constraint of (2.9): t_d >= 1


@inlined
def opens_s(episode: State, c: Constants) -> float:
    """From when on (s) the next attack is legal, as far as time goes."""
    return float(max(EARLIEST_S, episode.opening_s[0], episode.attacked_s[0] + c.attack_pause_s))


@inlined
def mark_legal(episode: State, c: Constants, budget: int, steps_per_decision: int, legal: BoolArray) -> None:
    """Fill `legal` (N + 1,), or (2 N,) with jams: waiting (0) always, the rest for platoons i (1 = rear) that exist.

    Action i attacks an intact platoon that the budget covers; N + i moves the jam to the link ahead of platoon i,
    while there is time of jamming left. Decisions are due every `steps_per_decision` integration steps.
    """
    step, platoons = episode.step[0], c.num_vehicles // c.vehicles_per_platoon
    time_s, most = step * c.dt_s, episode.disbanding_s.size
    due = step % steps_per_decision == 0
    may_disband = due and budget > 0 and has_begun(time_s, opens_s(episode, c))
    may_jam = due and episode.jam_steps[0] > 0 and has_begun(time_s, max(EARLIEST_S, episode.opening_s[0]))
    legal[0] = True
    for i in range(1, most + 1):
        legal[i] = may_disband and i <= platoons and episode.disbanding_s[platoons - i] == np.inf
    for i in range(1, legal.size - most):
        moves = i < platoons and episode.jam_place[0] != platoons - i - 1
        legal[most + i] = may_jam and moves


@inlined
def disband(episode: State, c: Constants, target: int, budget: IntArray, legal: BoolArray) -> None:
    """Do what action `target` says where that is legal; else it means waiting. An attack is charged to `budget` (1,).

    It disbands a platoon at once, or jolts its attacked vehicle. A jam stays on until it is moved or its time is spent.
    """
    if target > 0 and legal[target]:
        platoons, most = c.num_vehicles // c.vehicles_per_platoon, episode.disbanding_s.size
        if target > most:
            episode.jam_place[0] = platoons - (target - most) - 1
        else:
            time_s, last = episode.step[0] * c.dt_s, (platoons - target + 1) * c.vehicles_per_platoon - 1
            if c.jolt_mps2 > 0.0:
                begin_jolt(episode, c, platoons - target, time_s)
            else:
                episode.disbanding_s[platoons - target] = time_s
                take_record(episode, last, last, time_s)
            episode.attacked_s[0] = time_s
            budget[0] -= 1
