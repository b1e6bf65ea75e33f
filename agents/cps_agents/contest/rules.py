"""What makes a game a contest, and whether a problem's game is one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.contest.jobs import Played
from cps_baselines.arena import Contestant
from cps_envs.core.types import ROLES, FloatArray, Role, other

NEUTRAL = "none"
TOLD = "told whom it faces"
NOT_WON = "nobody has won"
BEST_CONSTANT = "best constant"


@dataclass(frozen=True)
class Finding:
    """A rule as it was found for a role."""

    rule: str
    role: Role
    holds: bool
    better: str  # who has to be better
    worse: str
    lead: Estimate  # paired, in the direction of the role
    margin: float  # that the lead has to exceed


def judge(played: Played) -> list[Finding]:
    """Every rule for both roles."""
    return [finding for role in ROLES for finding in _of_role(played, role)]


def _of_role(played: Played, role: Role) -> Iterator[Finding]:
    side = played.side(role)
    policies = list(side.policies)
    best = played.best(role, [each for each in policies if each.name != NEUTRAL])
    scores = {each.name: played.scores(role, each) for each in policies}
    constant = played.constant(role)
    if constant is not None:
        found = played.scores(role, constant)
        yield _finding("no constant action is best", role, (best.name, scores[best.name]), (BEST_CONSTANT, found), 0.0)
    neutral = (NEUTRAL, scores[NEUTRAL])
    yield _finding("something can be done", role, (best.name, scores[best.name]), neutral, side.margin_neutral)
    informed = _informed(played, role)
    if informed is not None:
        rival = min(scores, key=lambda name: informed[1].mean() - scores[name].mean())
        yield _finding("something is left to infer", role, informed, (rival, scores[rival]), side.margin_informed)
    yield from (_not_won(played, role, each) for each in _nearest_to_winning(played, role))


def _informed(played: Played, role: Role) -> tuple[str, FloatArray] | None:
    """The reference of a role that is told what the others have to infer."""
    choices = list(played.side(role).informed)
    best = played.best(role, choices) if choices else None
    found = None if best is None else (best.name, played.scores(role, best))
    if role == "attacker" and played.responses:
        told = (TOLD, played.told())
        if found is None or told[1].mean() > found[1].mean():
            return told
    return found


def _finding(
    rule: str, role: Role, better: tuple[str, FloatArray], worse: tuple[str, FloatArray], margin: float
) -> Finding:
    lead = estimate([(better[1] - worse[1])[None]])
    return Finding(rule, role, lead.mean > margin, better[0], worse[0], lead, margin)


def best_possible(played: Played, role: Role) -> float:
    """What the attacker is paid at best for a role: without an attack, or by the best attack without a defence."""
    if role == "defender":
        rows = (played.values("defender", each) for each in played.side(role).policies)
        idle = [each.name for each in played.contest.attackers.policies].index(NEUTRAL)
        return float(min(row[idle].mean() for row in rows))
    paid = [played.meetings[each.name, NEUTRAL]["return"].mean() for each in played.rated("attacker")]
    if NEUTRAL in played.responses:
        paid.append(played.meetings[played.responses[NEUTRAL].name, NEUTRAL]["return"].mean())
    return float(max(paid))


def shortfall(played: Played, role: Role, contestant: Contestant) -> tuple[str, FloatArray]:
    """Against whom a policy is furthest from its role's best possible value, and by how much, (E,)."""
    ideal = best_possible(played, role)
    rivals = played.rated(other(role))
    found = {}
    for rival in rivals:
        pair = (contestant.name, rival.name) if role == "attacker" else (rival.name, contestant.name)
        paid = played.meetings[pair]["return"]
        found[rival.name] = ideal - paid if role == "attacker" else paid - ideal
    if role == "defender" and contestant.name in played.responses:
        response = played.responses[contestant.name]
        found[response.name] = played.meetings[response.name, contestant.name]["return"] - ideal
    worst = max(found, key=lambda name: found[name].mean())
    return worst, found[worst]


def _nearest_to_winning(played: Played, role: Role) -> list[Contestant]:
    policies = played.side(role).policies
    return [min(policies, key=lambda each: shortfall(played, role, each)[1].mean())]


def _not_won(played: Played, role: Role, contestant: Contestant) -> Finding:
    rival, lost = shortfall(played, role, contestant)
    lead, margin = estimate([lost[None]]), played.contest.win_tolerance
    return Finding(NOT_WON, role, lead.mean > margin, rival, contestant.name, lead, margin)
