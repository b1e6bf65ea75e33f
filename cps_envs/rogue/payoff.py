"""What is measured of an episode, and the part of it that is paid."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.core.declare.measures import Measure
from cps_envs.rogue.controllers import HUMAN
from cps_envs.rogue.formation import reference_position
from cps_envs.rogue.state import Drawn, Rules, State


class Metrics(NamedTuple):
    """The measures of an episode so far."""

    damage: Annotated[float, Measure("m or m/s", "D of (5.8): m with contact pass, m/s with contact solid")]
    formation_charge: Annotated[
        float, Measure("m or m/s", "formation_weight times the formation cost, in the unit of damage")
    ]
    formation_cost_s: Annotated[float, Measure("s", "integral of the scattering c of the platoon")]
    damage_ahead: Annotated[
        float, Measure("m or m/s", "part of the damage between the rearmost seized vehicle and the leader")
    ]
    collisions: Annotated[float, Measure("", "contacts of two vehicles")]
    first_collision_s: Annotated[float, Measure("s", "time of the first contact; -1 if there was none")]
    alarms: Annotated[float, Measure("", "intact vehicles that have detected an attack")]
    first_alarm_s: Annotated[float, Measure("s", "time of the first alarm; -1 if there was none")]
    humans: Annotated[float, Measure("", "intact vehicles that are driven by hand now")]
    reference_error_m: Annotated[float, Measure("m", "how far the leader is behind its reference")]
    false_alarms: Annotated[
        float, Measure("", "vehicles that blame an intact neighbour; before the onset, all that blame one")
    ]
    attacked: Annotated[float, Measure("", "1 once the attacker drives")]


PAYOFF_PARTS = ("damage", "formation_charge")
HIDDEN_ONLY = ("false_alarms", "attacked")  # shown only where the seized vehicle is not marked


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
