"""How far the intact vehicles have scattered: the cost c that keeps a trained defence from driving apart."""

from __future__ import annotations

from cps_envs.core.kernels import inlined
from cps_envs.rogue.state import Drawn, Rules, State

FAR = 10.0  # separations, at which an error counts in full


@inlined
def reference_position(episode: State, c: Drawn, r: Rules) -> float:
    """x_ref, m: where the leader ought to be."""
    return float(c.reference_start_m + c.reference_speed_mps * episode.step[0] * r.dt_s)


@inlined
def scattering(episode: State, c: Drawn, r: Rules) -> float:
    """The cost c in [0, 1]: half the mean speed error of the intact vehicles, half their mean separation error.

    Separation errors are those of the leader to its reference and of the pairs without the seized vehicle; a speed
    error of v_ref and a separation error of 10 sigma count in full.
    """
    leader, wanted, far = episode.position.size - 1, c.reference_speed_mps, FAR * r.separation_m
    behind = abs(reference_position(episode, c, r) - episode.position[leader])
    speed_errors, errors, pairs = 0.0, min(1.0, behind / far), 1
    for i in range(leader + 1):
        if i == c.attacker:
            continue
        speed_errors += min(1.0, abs(episode.speed[i] - wanted) / wanted)
        if i < leader and i + 1 != c.attacker:
            gap = episode.position[i + 1] - episode.position[i]
            errors += min(1.0, abs(gap - r.separation_m) / far)
            pairs += 1
    return float(0.5 * speed_errors / leader + 0.5 * errors / pairs)
