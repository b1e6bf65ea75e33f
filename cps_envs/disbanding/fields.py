"""What each role observes: names, units and fixed bounds. `observation.py` fills them in."""

from __future__ import annotations

from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.disbanding.config import DisbandingConfig

MAX_GAP_M = 200.0
NEAR_GAP_M = 50.0
MAX_LAG_S = 1.0
MAX_DESIRED_GAP_M = 20.0
MAX_DISTANCE_M = 1000.0
MAX_AGE_S = 60.0
MAX_SILENCE_S = 10.0
SILENCE = "since a message of the vehicle ahead last came through: long where the link is jammed"


def _road(config: DisbandingConfig) -> tuple[Field, ...]:
    vehicles = config.max_vehicles
    return (
        Field("time_s", "s", 0, config.duration_s, (), "since the start"),
        Field("velocity_error", "%", 0, 100, (), "E_v (2.8) over all vehicles so far"),
        Field("collided", "vehicles", 0, vehicles, (), "involved in a collision so far"),
        Field("tau_s", "s", 0, max(MAX_LAG_S, bounds(config.tau_s)[1]), (), "actuation lag"),
        Field("desired_gap_m", "m", 0, max(MAX_DESIRED_GAP_M, bounds(config.desired_gap_m)[1]), (), "x_d"),
    )


def _kept(shape: tuple[int, ...], condition: bool) -> tuple[int, ...]:
    """The shape of a field that only some configurations have."""
    return shape if condition else (0,)


def waits(config: DisbandingConfig) -> bool:
    """Whether an attack can be illegal because it is too early, other than in the first second."""
    return bounds(config.earliest_attack_s)[1] > 1 or config.attack_pause_s > 1


def _present(config: DisbandingConfig) -> Field:
    drawn = isinstance(config.num_platoons, tuple)
    return Field("present", "-", 0, 1, (config.max_platoons if drawn else 0,), "the platoon exists in this episode")


def attacker_fields(config: DisbandingConfig) -> Fields:
    """One row per platoon, row i - 1 being the paper's platoon i (1 = rear), then the road as a whole.

    Rows of platoons that are absent in an episode are zero; `present` tells, where their number is drawn.
    """
    platoons, fastest, jam_s = config.max_platoons, config.max_speed_mps, bounds(config.jam_budget_s)[1]
    return Fields(
        Field("mean_speed", "m/s", 0, fastest, (platoons,), "of the platoon's vehicles"),
        Field("min_speed", "m/s", 0, fastest, (platoons,), "slowest vehicle of the platoon"),
        Field("leader_gap", "m", -NEAR_GAP_M, MAX_GAP_M, (platoons - 1,), "ahead of the leader; not for the last row"),
        Field("mean_gap", "m", -NEAR_GAP_M, NEAR_GAP_M, (platoons,), "inside the platoon"),
        Field("min_gap", "m", -NEAR_GAP_M, NEAR_GAP_M, (platoons,), "inside the platoon"),
        Field("stopped", "-", 0, 1, (platoons,), "share of the platoon's vehicles below 0.01 m/s"),
        Field("disbanded", "-", 0, 1, (platoons,), "the platoon has been disbanded"),
        Field("since_disbanding_s", "s", 0, config.duration_s, (platoons,), "0 while intact"),
        _present(config),
        Field("budget_left", "platoons", 0, config.max_budget, (), "that may still be disbanded"),
        Field("opens_in_s", "s", 0, config.duration_s, _kept((), waits(config)), "until the next attack is legal"),
        Field("jam_left_s", "s", 0, max(jam_s, 1), _kept((), config.can_jam), "of blocking a radio link"),
        Field("jammed", "-", 0, 1, _kept((platoons - 1,), config.can_jam), "the link ahead of the platoon is blocked"),
        *_road(config),
    )


def defender_fields(config: DisbandingConfig) -> Fields:
    """One entry per vehicle, front (q = 0) to rear; platoon rows as for the attacker (row i - 1 = paper platoon i)."""
    vehicles, platoons = config.max_vehicles, config.max_platoons
    fastest, low, high = config.max_speed_mps, config.min_acceleration_mps2, config.max_acceleration_mps2
    reach = high - low  # of a correction
    relayed = config.is_relayed
    behind = vehicles - config.vehicles_per_platoon  # nobody disbands ahead of the front platoon
    corrected = vehicles if config.correctable == "intact" else behind
    correctable = "a correction would act" + ("" if corrected == vehicles else ", q >= n")
    told = behind if relayed else platoons - 1  # rows of what the warning says
    distance = "from there to the vehicle now" if relayed else "from it to the leader"
    distance += "; the bound if none"
    source = "nearest disbanded vehicle ahead" + (", by the record" if relayed else " of the platoon")
    return Fields(
        Field("speed", "m/s", 0, fastest, (vehicles,), "of each vehicle"),
        Field("acceleration", "m/s2", low, high, (vehicles,), "of each vehicle"),
        Field("gap", "m", -NEAR_GAP_M, MAX_GAP_M, (vehicles - 1,), "ahead of vehicles q >= 1"),
        Field("relative_speed", "m/s", -fastest, fastest, (vehicles - 1,), "predecessor's minus own, q >= 1"),
        Field("law_command", "m/s2", low, high, (vehicles,), "the plain law's command, clipped, before (2.6)"),
        Field("mitigable", "-", 0, 1, (corrected,), correctable),
        Field("warned", "-", 0, 1, _kept((behind,), relayed), "the vehicle has received a record, q >= n"),
        Field("record_age_s", "s", 0, MAX_AGE_S, _kept((behind,), relayed), "of that record; 0 if there is none"),
        Field("silence_s", "s", 0, MAX_SILENCE_S, _kept((behind,), relayed), SILENCE),
        Field("disbanded", "-", 0, 1, _kept((platoons,), not relayed), "the platoon has been disbanded"),
        Field("ahead_speed", "m/s", 0, fastest, (told,), source),
        Field("ahead_acceleration", "m/s2", low, high, (told,), "of that vehicle; 0 if there is none"),
        Field("ahead_command", "m/s2", low - reach, high + reach, (told,), "its final command; 0 if none"),
        Field("ahead_distance", "m", 0, MAX_DISTANCE_M, (told,), distance),
        _present(config),
        *_road(config),
    )


def vehicle_fields(config: DisbandingConfig) -> Fields:
    """The own row of one vehicle in the swarm form: own sensors, its predecessor's radio, and the broadcast."""
    fastest, low, high = config.max_speed_mps, config.min_acceleration_mps2, config.max_acceleration_mps2
    reach, relayed = high - low, config.is_relayed
    since, told = ((0,), "record") if relayed else ((), "broadcast")
    return Fields(
        Field("active", "-", 0, 1, (), "the vehicle exists and its platoon is intact"),
        Field("mitigable", "-", 0, 1, (), "a correction would act"),
        Field("leads", "-", 0, 1, (), "first of its platoon"),
        Field("trails", "-", 0, 1, (), "last of its platoon"),
        Field("place", "-", 0, 1, (), "q / (M - 1), 0 at the front of the string"),
        Field("speed", "m/s", 0, fastest, (), "own"),
        Field("acceleration", "m/s2", low, high, (), "own"),
        Field("gap", "m", 0, MAX_GAP_M, (), "ahead; the bound for the front vehicle"),
        Field("gap_error", "m", -NEAR_GAP_M, NEAR_GAP_M, (), "gap ahead minus x_d, or minus h v for a leader"),
        Field("rear_gap_error", "m", -NEAR_GAP_M, NEAR_GAP_M, (), "gap behind minus x_d; 0 for the rear vehicle"),
        Field("relative_speed", "m/s", -fastest, fastest, (), "predecessor's minus own"),
        Field("rear_relative_speed", "m/s", -fastest, fastest, (), "own minus follower's"),
        Field("avoidance_margin", "m", -NEAR_GAP_M, NEAR_GAP_M, (), "gap minus the bound of (2.6)"),
        Field("law_command", "m/s2", low, high, (), "own, by the plain law, clipped"),
        Field("predecessor_acceleration", "m/s2", low, high, (), "by radio"),
        Field("predecessor_command", "m/s2", low, high, (), "by radio: final command of the last step, clipped"),
        Field("since_disbanding_s", "s", 0, config.duration_s, since, "since the first disbanding ahead; 0 if none"),
        Field("warned", "-", 0, 1, _kept((), relayed), "has received a record"),
        Field("record_age_s", "s", 0, MAX_AGE_S, _kept((), relayed), "of that record; 0 if there is none"),
        Field("silence_s", "s", 0, MAX_SILENCE_S, _kept((), relayed), SILENCE),
        Field("ahead_speed", "m/s", 0, fastest, (), f"{told}: nearest disbanded vehicle ahead; v_d if none"),
        Field("ahead_acceleration", "m/s2", low, high, (), f"{told}: of that vehicle; 0 if none"),
        Field("ahead_command", "m/s2", low - reach, high + reach, _kept((), relayed), f"{told}: its final command"),
        Field("ahead_distance", "m", 0, MAX_DISTANCE_M, (), "to that vehicle; the bound if none"),
        Field("tau_s", "s", 0, max(MAX_LAG_S, bounds(config.tau_s)[1]), (), "actuation lag"),
        Field("desired_gap_m", "m", 0, max(MAX_DESIRED_GAP_M, bounds(config.desired_gap_m)[1]), (), "x_d"),
    )
