"""What is measured of an episode, and the part of it that is paid."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.rogue.controllers import HUMAN
from cps_envs.rogue.formation import reference_position
from cps_envs.rogue.state import Drawn, Rules, State


class Metrics(NamedTuple):
    """The measures of an episode so far."""

    damage: float  # D of (5.8): m with contact "pass", m/s with "solid"
    formation_charge: float  # in the unit of damage, w times the formation cost
    formation_cost_s: float  # s, integral of the scattering c
    damage_ahead: float  # the part of the damage in pairs from the seized vehicle on to the leader
    collisions: float  # contacts of a pair
    first_collision_s: float  # s, -1 if none
    alarms: float  # intact vehicles that have detected an attack
    first_alarm_s: float  # s, -1 if none
    humans: float  # intact vehicles driven by hand now
    reference_error_m: float  # m, the leader behind its reference
    false_alarms: float  # vehicles that blame an intact neighbour, as all do before the onset
    attacked: float  # 1 once the attacker drives


PAYOFF_PARTS = ("damage", "formation_charge")
HIDDEN_ONLY = 2  # metrics at the end that are shown only where the seized vehicle is not marked


@inlined
def measure(episode: State, score: Record, c: Drawn, r: Rules) -> None:
    """Bring the metrics of an episode up to date; times and the formation cost are kept while it advances."""
    damage = ahead = collisions = alarms = humans = 0.0
    for i in range(episode.damage.size):
        damage += episode.damage[i]
        ahead += episode.damage[i] if i >= c.attacker else 0.0
        collisions += episode.collisions[i]
    for i in range(episode.alarm.size):
        alarms += abs(episode.alarm[i])
        humans += episode.controller[i] == HUMAN
    score.damage, score.damage_ahead, score.collisions = damage, ahead, collisions
    score.alarms, score.humans, score.attacked = alarms, humans, episode.step[0] > c.onset_step
    score.formation_charge = r.formation_weight_mps2 * score.formation_cost_s
    score.reference_error_m = reference_position(episode, c, r) - episode.position[-1]
