"""The goal of section 3.3: an attacker who is paid for what the errors grow, (3.20) with P = 1."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_paper.fdi.interpretations import FIGURE, INTERPRETATIONS
from tests.fdi.episodes import play

UNSTABLE = INTERPRETATIONS["instability"]


def size_m(decoded: dict[str, Array], pairs: list[int] | range) -> float:  # of observed errors
    return np.sqrt(sum(decoded["gap_error"][i] ** 2 + decoded["relative_speed"][i] ** 2 for i in pairs))


@pytest.mark.parametrize(("paid_pair", "pairs"), [("target", [1]), ("any", range(10))])
def test_each_step_pays_what_the_errors_have_grown(paid_pair: str, pairs: list[int] | range) -> None:
    env = gymnasium.make(
        "cps_envs:cps_envs/FdiAttack-v0",
        **{**UNSTABLE, "attacked": "xv2", "target": 2, "paid_pair": paid_pair, "horizon": 30},
        preset="paper",
        gap_spread_m=0.5,
        opponent="none",
    ).unwrapped
    observation, info = env.reset(seed=3)
    decode, generator, ended, paid = env.game.fields["attacker"].decode, np.random.default_rng(0), False, 0.0
    before = first = size_m(decode(observation), pairs)
    assert first > 0
    assert info["error_size_m"] == pytest.approx(first, abs=1e-4)
    while not ended:
        masks = np.split(info["action_mask"], np.cumsum(env.action_space.nvec)[:-1])
        action = [generator.choice(np.flatnonzero(mask)) for mask in masks]
        observation, reward, terminated, truncated, info = env.step(action)
        ended, after = terminated or truncated, size_m(decode(observation), pairs)
        assert reward == pytest.approx(after - before, abs=1e-4)
        paid, before = paid + reward, after
    assert paid == pytest.approx(info["error_growth_m"], abs=1e-9)
    assert info["error_growth_m"] == pytest.approx(info["error_size_m"] - first, abs=1e-4)
    assert info["bound_valid"] == 0
    assert env.game.payoff_parts[0] == "error_growth_m"


def test_the_goal_changes_what_is_paid_and_nothing_else() -> None:
    same = {"seeds": range(6), "attacked": "v4", "target": 4}
    collision, unstable = play("bang_bang", **same), play("bang_bang", goal="instability", **same)
    for name in ("impact_speed_mps", "worst_impact_mps", "time_s", "injected_share"):
        np.testing.assert_array_equal(collision[name], unstable[name])
    assert "error_growth_m" not in collision
    assert not np.array_equal(collision["return"], unstable["return"])


def test_nobody_is_paid_at_rest() -> None:
    outcome = play("none", **UNSTABLE)
    assert outcome["return"] == outcome["error_growth_m"] == 0


@pytest.mark.parametrize("attacked", ["x4", "v4", "xv4"])
def test_algorithm_2_destabilises(attacked: str) -> None:
    """Where nothing limits commands its conditions hold in every step, so that the errors of the lead grow."""
    lead = attacked.replace("4", "10")
    paid = play("bnb", **{**FIGURE, "goal": "instability", "attacked": lead, "paid_pair": "target"})
    assert paid["return"] > 1.0
    assert paid["collided_pairs"] > 0


def test_it_destabilises_within_the_limits_too() -> None:
    assert play("bnb", **UNSTABLE)["return"] > 0
