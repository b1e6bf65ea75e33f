"""How far the intact vehicles have scattered: the cost c that keeps a trained defence from driving apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.kernel import Record, kernel

FAR = 10.0  # separations, at which an error counts in full


@kernel
def reference_position(episode: Record, log: Record, r: Record) -> float:
    """x_ref, m: where the leader ought to be."""
    return float(episode.reference_start_m + episode.reference_speed_mps * log.step * r.dt_s)


@kernel
def scattering(vehicles: NDArray[np.void], episode: Record, log: Record, r: Record) -> float:
    """The cost c in [0, 1]: half the mean speed error of the intact vehicles, half their mean separation error.

    Separation errors are those of the leader to its reference and of the pairs without the seized vehicle; a speed
    error of v_ref and a separation error of 10 sigma count in full.
    """
    leader, seized, wanted = len(vehicles) - 1, episode.attacker, episode.reference_speed_mps
    far = FAR * r.separation_m
    behind = abs(reference_position(episode, log, r) - vehicles[leader].position)
    speed_errors, errors, pairs = 0.0, min(1.0, behind / far), 1
    for i in range(leader + 1):
        if i == seized:
            continue
        speed_errors += min(1.0, abs(vehicles[i].speed - wanted) / wanted)
        if i < leader and i + 1 != seized:
            gap = vehicles[i + 1].position - vehicles[i].position
            errors += min(1.0, abs(gap - r.separation_m) / far)
            pairs += 1
    return float(0.5 * speed_errors / leader + 0.5 * errors / pairs)
