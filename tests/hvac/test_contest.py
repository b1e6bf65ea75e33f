"""What the contest plays of the HVAC problem: everybody takes part, and preset `learning` is a contest."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from cps_baselines.contest import Variant
from cps_baselines.hvac.contest import CONTEST
from cps_envs.core.lookup import BUILT_IN, policy_names, resolve_policy
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import ROLES, Array, Role
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from tests.hvac.games import play

SIDES = {"attacker": CONTEST.attackers, "defender": CONTEST.defenders}
DAYS = range(5_000_000, 5_000_060)  # unlike those that anything was tuned on
NOISY = ("tracker", "ramp?rate_c_per_h=0.7&keep_noise=true", "mimic?keep_noise=true")
STRONG = (*NOISY, *(f"{name}{'&' if '?' in name else '?'}warmer=true" for name in NOISY), "brink", "constant")


def spec_of(role: Role, variant: Variant) -> RoleSpec:
    return HvacGame(HVAC.config(variant.preset, variant.overrides), 1).spec(role)


@pytest.mark.parametrize("role", ROLES)
def test_every_registered_policy_plays_or_is_left_out_for_a_reason(role: Role) -> None:
    side = SIDES[role]
    entered = {contestant.reference.partition("?")[0] for contestant in (*side.policies, *side.informed)}
    left = set(side.left_out)
    names = set(policy_names("hvac", role)) - set(BUILT_IN)
    assert names | {"none"} == entered | {name for name in left if not name.startswith("zoo:")}
    assert not entered & left
    assert all(side.left_out.values())


@pytest.mark.parametrize("role", ROLES)
def test_names_are_told_apart(role: Role) -> None:
    names = [contestant.name for contestant in (*SIDES[role].policies, *SIDES[role].informed)]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("variant", CONTEST.variants, ids=lambda variant: variant.name)
@pytest.mark.parametrize("role", ROLES)
def test_all_of_them_can_be_built_in_every_variant(role: Role, variant: Variant) -> None:
    side, spec = SIDES[role], spec_of(role, variant)
    for reference in (*(each.reference for each in (*side.policies, *side.informed)), *side.constants):
        resolve_policy(reference, spec)
    for search in side.searches:
        for end in (0, 1):
            resolve_policy(search.policy, spec, **{name: ends[end] for name, ends in search.ranges.items()})


def test_constants_of_the_defender_are_all_there_are() -> None:
    count = spec_of("defender", CONTEST.variants[0]).action_space.n
    assert CONTEST.defenders.constants == tuple(f"always?action={choice}" for choice in range(count))


@lru_cache
def paid(attacker: str, defender: str, **overrides: Any) -> Array:
    return play(attacker, defender, DAYS, "learning", **overrides)["return"]


def mean_over(defender: str) -> float:
    return np.mean([paid(attacker, defender).mean() for attacker in ("none", *STRONG)])


@pytest.mark.slow
def test_something_is_left_to_infer_and_something_can_be_done() -> None:
    scores = {name: mean_over(name) for name in ("none", "mtd2", "model_only", "cusum", "largest", "informed", "truth")}
    best = min(scores[name] for name in ("none", "mtd2", "model_only", "cusum", "largest"))
    assert max(scores["informed"], scores["truth"]) + CONTEST.defenders.margin_informed < best
    assert best + CONTEST.defenders.margin_neutral < scores["none"]


@pytest.mark.slow
def test_no_choice_that_never_changes_is_as_good_as_the_best_detector() -> None:
    bar = mean_over("largest")
    assert bar < min(mean_over(constant) for constant in CONTEST.defenders.constants)


@pytest.mark.slow
def test_lies_of_both_signs_matter() -> None:
    for defender in ("mtd2", "cusum", "largest"):
        for attacker in STRONG[:6]:
            excess = paid(attacker, defender) - paid("none", defender)
            assert excess.mean() > 1.0, (attacker, defender)


@pytest.mark.slow
def test_believing_nobody_is_no_way_out() -> None:
    for attacker in ("none", *STRONG):
        excess = paid(attacker, "model_only") - paid(attacker, "largest")
        assert excess.mean() - 2.0 * excess.std() / np.sqrt(len(excess)) > 0.0, attacker


@pytest.mark.slow
def test_more_liars_cost_more() -> None:
    """Excess over who is told who lies, on the same days."""
    found = []
    for liars in (1, 3):
        days = {"compromised_weights": (), "num_compromised": liars}
        found.append((paid("tracker", "largest", **days) - paid("tracker", "informed", **days)).mean())
    assert found[1] > 2.0 * found[0]


@pytest.mark.slow
def test_listening_pays_and_being_told_pays_more() -> None:
    """The attackers' side of the contest: bold lies earn most on the mean, and inferring whom one faces earns more."""
    defenders = [contestant.reference for contestant in CONTEST.defenders.policies]
    bold, listening, creeping, tracking = (
        np.array([paid(attacker, defender) for defender in defenders])
        for attacker in ("constant?reading_c=10", "listener", "brink", "tracker")
    )
    told = np.array([max((bold, creeping, tracking), key=lambda pay: pay[place].mean())[place] for place in range(7)])
    for better, worse in ((listening, bold), (told, listening)):
        lead = (better - worse).mean(axis=0)
        assert lead.mean() - 2.0 * lead.std() / np.sqrt(len(lead)) > 0.0
