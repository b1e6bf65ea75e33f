"""How far the intact vehicles have scattered: the costs c that keep a trained defence from driving apart."""

from __future__ import annotations

from math import log

from cps_envs.core.compute.kernels import inlined
from cps_envs.rogue.state import Drawn, Rules, State

FAR = 10.0  # separations, at which an error counts in full
SLOW_MPS = 1.0  # speed errors are shares of at least this


@inlined
def reference_position(episode: State, c: Drawn, r: Rules) -> float:
    """x_ref, m: where the leader ought to be."""
    return float(c.reference_start_m + c.reference_speed_mps * episode.step[0] * r.dt_s)


@inlined
def formation_cost(episode: State, c: Drawn, r: Rules) -> float:
    """The cost c of the configuration at this moment."""
    return log_place(episode, c, r) if r.logarithmic else scattering(episode, c, r)


@inlined
def log_place(episode: State, c: Drawn, r: Rules) -> float:
    """log(1 + mean distance of the vehicles from their places, in sigma): it never saturates.

    Every vehicle counts that the defender drives: all until the onset, from then on all but the seized ones.
    """
    attacked, reference, distance, count = episode.step[0] >= c.onset_step, reference_position(episode, c, r), 0.0, 0
    for i in range(episode.position.size):
        if not (attacked and episode.rogue[i]):
            distance += abs(place(episode, i, reference, attacked, c, r) - episode.position[i])
            count += 1
    return log(1.0 + distance / (count * r.separation_m))


@inlined
def place(episode: State, i: int, reference: float, attacked: bool, c: Drawn, r: Rules) -> float:
    """Where vehicle `i` ought to be, m: behind the reference, by sigma for each vehicle ahead of it.

    Nobody can pass in one lane. With open places, a seized vehicle that is in the way shifts the places on its far
    side: behind it they end, and ahead of it they begin, as many sigma from it as vehicles lie between.
    """
    wanted = reference - (episode.position.size - 1 - i) * r.separation_m
    if r.open_places and attacked:
        for seat in range(c.attacker, episode.position.size):
            if episode.rogue[seat]:
                beside = episode.position[seat] + (i - seat) * r.separation_m
                wanted = min(wanted, beside) if i < seat else max(wanted, beside)
    return float(wanted)


@inlined
def scattering(episode: State, c: Drawn, r: Rules) -> float:
    """The cost c in [0, 1]: half the mean speed error of the intact vehicles, half their mean separation error.

    Separation errors are those of an intact leader to its reference and of the pairs without a seized vehicle; a speed
    error of v_ref and a separation error of 10 sigma count in full.
    """
    leader, wanted, far = episode.position.size - 1, c.reference_speed_mps, FAR * r.separation_m
    behind = abs(reference_position(episode, c, r) - episode.position[leader])
    speed_errors, errors, pairs, intact = 0.0, min(1.0, behind / far), 1, 0
    if episode.rogue[leader]:
        errors, pairs = 0.0, 0
    for i in range(leader + 1):
        if episode.rogue[i]:
            continue
        intact += 1
        speed_errors += min(1.0, abs(episode.speed[i] - wanted) / max(wanted, SLOW_MPS))
        if i < leader and not episode.rogue[i + 1]:
            gap = episode.position[i + 1] - episode.position[i]
            errors += min(1.0, abs(gap - r.separation_m) / far)
            pairs += 1
    return float(0.5 * speed_errors / intact + 0.5 * errors / max(pairs, 1))
