"""The claims about Fig. 2.3 and the optimal attacks: P21 to P28, P37 and P38."""

from __future__ import annotations

from itertools import pairwise

from cps_baselines.disbanding.reproduction.experiments import (
    ATTACK_S,
    ATTACKS,
    FIGURE_TAUS_S,
    LATER_S,
    PLATOONS,
    SECOND_PLANS,
    TAUS_S,
    Evidence,
)
from cps_baselines.disbanding.reproduction.rules import CLAIMS
from cps_baselines.paper.tables import POINTS
from cps_baselines.reproduction.claims import Claim, Finding, applying, joined
from cps_baselines.reproduction.verdicts import of_cases, of_number


@CLAIMS.judges("P21", "P22")
def mean_error(evidence: Evidence, claim: Claim) -> Finding:
    """E_v of Figs. 2.3a and b, averaged over the intact vehicles."""
    attack = ((10, ATTACK_S),) if claim.id == "P21" else ATTACKS["2.3"]
    outcome = evidence[evidence.experiments.rear_speeds(attack)].outcome
    value = outcome.velocity_error_intact
    shown = f"{value:.2f} % over intact vehicles ({outcome.velocity_error_all:.2f} % over all)"
    return Finding(value, shown, of_number(value, claim.number, POINTS))


@CLAIMS.judges("P23")
def lead_is_best(evidence: Evidence, claim: Claim) -> Finding:
    """Disbanding any other platoon at the first instant is worse, for every N and tau."""
    hold = []
    for tau_s in FIGURE_TAUS_S:
        for count in PLATOONS:
            errors = [_error(evidence, count, tau_s, platoon) for platoon in range(1, count + 1)]
            hold.append(max(errors) == errors[-1])
    return Finding(all(hold), f"in {sum(hold)} of {len(hold)} cases of N and tau", of_cases(hold))


@CLAIMS.judges("P24")
def first_instant_is_best(evidence: Evidence, claim: Claim) -> Finding:
    """The best second for the lead platoon, over N and tau."""
    times, best = (1.0, *LATER_S), []
    for tau_s in FIGURE_TAUS_S:
        for count in PLATOONS:
            errors = [_error(evidence, count, tau_s, time_s=time_s) for time_s in times]
            best.append(times[errors.index(max(errors))])
    hold = [time_s == claim.number for time_s in best]
    flat = [_error(evidence, PLATOONS[-1], TAUS_S[0], time_s=time_s) for time_s in (times[0], times[3])]
    shown = f"1 s in {sum(hold)} of {len(hold)} cases; flat: {flat[0]:.2f} % at 1 s, {flat[1]:.2f} % at {times[3]:g} s"
    return Finding(max(set(best), key=best.count), shown, of_cases(hold))


@CLAIMS.judges("P25")
def grows(evidence: Evidence, claim: Claim) -> Finding:
    """E_v over the number of platoons, for every tau."""
    curves = {tau_s: [_error(evidence, count, tau_s) for count in PLATOONS] for tau_s in FIGURE_TAUS_S}
    hold = [all(a < b for a, b in pairwise(curve)) for curve in curves.values()]
    ends = ", ".join(f"{curves[tau_s][0]:.1f} to {curves[tau_s][-1]:.1f}" for tau_s in TAUS_S)
    return Finding(
        all(hold), f"for every tau; N = 2 to 10: {ends} % at tau {joined(list(TAUS_S), 'g')} s", of_cases(hold)
    )


@CLAIMS.judges("P26")
def crash_threshold(evidence: Evidence, claim: Claim) -> Finding:
    """The largest tau without any collision; below and above it, whatever N, none and some."""
    hold, safe = [], []
    for tau_s in FIGURE_TAUS_S:
        crashes = [_collided(evidence, count, tau_s) > 0 for count in PLATOONS]
        hold += [crash == (tau_s > claim.number) for crash in crashes]
        safe += [] if any(crashes) else [tau_s]
    threshold = max(safe, default=None)
    return Finding(threshold, f"as claimed in {sum(hold)} of {len(hold)} cases of N and tau", of_cases(hold))


@CLAIMS.judges("P27")
def more_collisions(evidence: Evidence, claim: Claim) -> Finding:
    """Vehicles involved in collisions over N, for every tau that has collisions."""
    curves = {tau_s: [_collided(evidence, count, tau_s) for count in PLATOONS] for tau_s in FIGURE_TAUS_S}
    applies = applying(sum(map(any, curves.values())), len(curves), "tau")
    curves = {tau_s: curve for tau_s, curve in curves.items() if any(curve)}
    hold = [all(a < b for a, b in pairwise(curve)) for curve in curves.values()]
    ends = ", ".join(f"{curve[0]} to {curve[-1]} (tau {tau_s:g} s)" for tau_s, curve in curves.items())
    return Finding(bool(hold) and all(hold), f"vehicles for N = 2 to 10: {ends}; {applies}", of_cases(hold or [False]))


@CLAIMS.judges("P28")
def rear_vehicles_stop(evidence: Evidence, claim: Claim) -> Finding:
    """The rear vehicles of the nine intact platoons: all slow down, some stop."""
    record = evidence[evidence.experiments.rear_speeds(((10, ATTACK_S),))]
    size = record.config.vehicles_per_platoon
    rear = slice(2 * size - 1, None, size)
    slower = (record.speed_mps[:, rear].min(axis=0) < record.config.desired_speed_mps - 1.0).tolist()
    stopped = record.outcome.stops[rear] > 0
    shown = f"{sum(slower)} of {len(slower)} slow down, {stopped.sum()} stop"
    return Finding(all(slower) and bool(stopped.any()), shown, of_cases([*slower, bool(stopped.any())]))


@CLAIMS.judges("P37", "P38")
def second_attack(evidence: Evidence, claim: Claim) -> Finding:
    """The best second platoon and second on a grid, with the lead platoon disbanded at 2 s."""
    best = [best_second(evidence, tau_s) for tau_s in TAUS_S]
    which = 0 if claim.id == "P37" else 1
    hold = [of_number(plan[which], claim.number) == "reproduced" for plan in best]
    paper = [second_error(evidence, tau_s, *ATTACKS["2.3"][1]) for tau_s in TAUS_S]
    gains = [
        second_error(evidence, tau_s, *plan) - value for tau_s, plan, value in zip(TAUS_S, best, paper, strict=True)
    ]
    shown = "; ".join(
        f"tau {tau_s:g} s: ({platoon}, {time_s:g} s)" + (f", {gain:.1f} points above the paper's" if gain else "")
        for tau_s, (platoon, time_s), gain in zip(TAUS_S, best, gains, strict=True)
    )
    return Finding(best[0][which], shown, of_cases(hold))


def best_second(evidence: Evidence, tau_s: float) -> tuple[int, float]:
    """The platoon and second, with the lead platoon disbanded at 2 s, with the largest E_v over all vehicles."""
    return max(SECOND_PLANS, key=lambda plan: second_error(evidence, tau_s, *plan))


def second_error(evidence: Evidence, tau_s: float, platoon: int, time_s: float) -> float:
    """E_v in percent over all vehicles of a two-platoon attack."""
    return evidence[evidence.experiments.second(tau_s, platoon, time_s)].velocity_error_all


def _error(evidence: Evidence, count: int, tau_s: float, platoon: int | None = None, time_s: float = 1.0) -> float:
    return evidence[evidence.experiments.single(count, tau_s, platoon, time_s)].velocity_error_intact


def _collided(evidence: Evidence, count: int, tau_s: float) -> int:
    return int(evidence[evidence.experiments.single(count, tau_s)].collided.sum())
