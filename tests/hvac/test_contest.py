"""What the contest plays of the HVAC problem: preset `learning` is a contest."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from cps_baselines.hvac.contest import CONTEST
from cps_envs.core.types import Array
from tests.hvac.games import play, spec_of

DAYS = range(5_000_000, 5_000_060)  # unlike those that anything was tuned on
NOISY = ("tracker", "ramp?rate_c_per_h=0.7&keep_noise=true", "mimic?keep_noise=true")
STRONG = (*NOISY, *(f"{name}{'&' if '?' in name else '?'}warmer=true" for name in NOISY), "brink", "constant")


def test_constants_of_the_defender_are_all_there_are() -> None:
    count = spec_of("defender").action_space.n
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
