"""What is measured in an episode, row by row of the game's table (number of metrics + 1, B)."""

from __future__ import annotations

METRICS = (
    "impact_speed_mps",  # what the attacker is paid at the end: of the target pair, or of any pair
    "alarm_cost_mps",  # paid for replaced readings so far
    "correction_cost_mps",  # paid for corrections so far
    "worst_impact_mps",  # fastest collision of any pair
    "collided_target",  # 1 when the target hit the vehicle ahead
    "collided_pairs",  # pairs that collided in the last step
    "illegal",  # 1 when an illegal injection, or a state without a legal one, ended the episode
    "time_s",  # since the start
    "injected_share",  # of all readings so far
    "replaced_share",  # of all readings so far
    "false_alarm_rate",  # share of the readings without injection that were replaced
    "bound_valid",  # 1 while `oracle_bound_mps` bounds what any attacker can be paid in this episode
    "oracle_bound_mps",  # certified upper bound of the task; 0, and not valid, where none is known
    "oracle_value_mps",  # speed that a known legal plan attains; 0 where none is known
)
PAID = METRICS[:3]
PAYOFF = len(METRICS)  # a last row: payoff of the last turn
(
    IMPACT,
    ALARM_COST,
    CORRECTION_COST,
    WORST_IMPACT,
    COLLIDED_TARGET,
    COLLIDED_PAIRS,
    ILLEGAL,
    TIME,
    INJECTED,
    REPLACED,
    FALSE_ALARMS,
    BOUND_VALID,
    BOUND,
    VALUE,
) = range(len(METRICS))
