"""What is measured and what is paid, read from a state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.formation import reference_position
from cps_envs.rogue.kernel import kernel
from cps_envs.rogue.laws import HUMAN
from cps_envs.rogue.state import State

METRICS = (
    "damage",  # D of (5.8): m with contact "pass", m/s with "solid"
    "formation_charge",  # in the unit of damage, w times the formation cost
    "formation_cost_s",  # s, integral of the scattering c
    "damage_ahead",  # the part of the damage in pairs from the seized vehicle on to the leader
    "collisions",  # contacts of a pair
    "first_collision_s",  # s, -1 if none
    "alarms",  # intact vehicles that have detected an attack
    "first_alarm_s",  # s, -1 if none
    "humans",  # intact vehicles driven by hand now
    "reference_error_m",  # m, the leader behind its reference
)
PAYOFF_PARTS = METRICS[:2]


@kernel
def measure(state: State, rules: NDArray[np.void], out: NDArray[np.float64]) -> None:
    """Fill `out` (B, len(METRICS)) with the metrics of each episode so far."""
    r = rules[0]
    for b in range(out.shape[0]):
        vehicles, pairs, episode, log, row = state.vehicles[b], state.pairs[b], state.episode[b], state.log[b], out[b]
        row[:] = 0.0
        for i in range(len(pairs)):
            row[0] += pairs[i].damage
            row[3] += pairs[i].damage if i >= episode.attacker else 0.0
            row[4] += pairs[i].collisions
        for i in range(len(vehicles)):
            row[6] += abs(vehicles[i].alarm)
            row[8] += i != episode.attacker and vehicles[i].law == HUMAN
        row[1] = r.formation_weight_mps2 * log.formation_cost_s
        row[2] = log.formation_cost_s
        row[5] = log.first_collision_s
        row[7] = log.first_alarm_s
        row[9] = reference_position(episode, log, r) - vehicles[-1].position
