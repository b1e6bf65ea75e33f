"""What the documents say of the duel, on seeds that nothing was tuned with."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from tests.fdi.episodes import play, watched

pytestmark = pytest.mark.slow

ATTACKED = {"preset": "learning", "attack_share": 1.0, "onset_s": 0.0}
CONTESTED = "v4>4 xv4>4 v1+rv2>1 xv1+rv2>1 v2+rv3>2 xv3+rv4>3"
SEEDS = range(50_000, 50_500)
FOUND = {  # by search, each against one defender; see `SEARCHES["attacker"]`
    "none": "swing?swing_s=2.24&open=0.96&close=0.99&range_part=0.97",
    "chi2": "tracker?margin=0.65&late=2.2&swing=1.67&swing_s=0.98&range_part=1.3",
    "cusum": "tracker?margin=0.95&late=1.29&swing=1.12&swing_s=0.15&range_part=1.17",
    "bank": "tracker?margin=0.19&late=1.37&swing=0.63&swing_s=0.09&range_part=1.17",
}


@lru_cache
def impact(attacker: str, defender: str, tasks: str = CONTESTED) -> float:
    """Mean impact speed in m/s of episodes with an attack."""
    outcome = play(attacker, defender, seeds=SEEDS, preset="learning", tasks=tasks, attack_share=1.0)
    return float(outcome["worst_impact_mps"].mean())


def worst(defender: str, tasks: str = CONTESTED) -> float:
    """The best of the attacks that were found."""
    return max(impact(attacker, defender, tasks) for attacker in FOUND.values())


def test_chi2_leaves_a_good_part_of_the_undefended_impact() -> None:
    assert worst("chi2") > 0.3 * worst("none")
    assert worst("none") > 3


def test_cusum_leaves_at_most_two_thirds_of_that() -> None:
    assert worst("cusum") < 2 / 3 * worst("chi2")
    assert worst("cusum") > 1  # something is left to win


def test_the_bank_leaves_less_and_is_not_unbeaten() -> None:
    assert 0.5 < worst("bank") < worst("cusum")


@pytest.mark.parametrize("tasks", [CONTESTED, "xv2>2 x4>4"])
def test_informed_leaves_nothing(tasks: str) -> None:
    assert worst("informed", tasks) < 0.1


def test_chi2_is_a_trap_where_rates_alone_are_false() -> None:
    assert worst("chi2", "v1+rv2>1 v4>4") > worst("none", "v1+rv2>1 v4>4")


def test_chi2_rejects_the_honest_sensor_more_than_the_false_one() -> None:
    rejected = watched(
        lambda game: game.state.trust[~game.terminated & (game.state.step > 20)] == 0,
        FOUND["chi2"],
        "chi2",
        SEEDS[:100],
        tasks="v4>4",
        **ATTACKED,
    )
    honest, false = np.concatenate(rejected).mean(axis=0)[[3, 10]]  # range and range-rate of the lead
    assert honest > 2 * false


def test_attackers_that_know_no_filter_are_stopped() -> None:
    for attacker in ("random", "bang_bang", FOUND["none"]):
        for defender in ("chi2", "cusum", "bank"):
            assert impact(attacker, defender) < 0.5, (attacker, defender)


@pytest.mark.parametrize("defender", ["chi2", "cusum", "bank"])
def test_no_honest_episode_of_two_thousand_ends_in_a_collision(defender: str) -> None:
    outcome = play("none", defender, seeds=range(60_000, 62_000), preset="learning", attack_share=0.0)
    assert outcome["collided_pairs"].max() == 0
    assert outcome["smallest_gap_m"].min() > 1
    assert outcome["false_alarm"].mean() < 0.1


@pytest.mark.parametrize("defender", ["chi2", "bank"])
def test_many_attacks_that_hit_are_missed_until_the_collision(defender: str) -> None:
    outcome = play(FOUND[defender], defender, seeds=SEEDS, preset="learning", tasks=CONTESTED, attack_share=1.0)
    hit = outcome["collided_pairs"] > 0
    assert hit.mean() > 0.3
    assert outcome["detected"][hit].mean() < 0.8
