"""Pay relative to the neutral action in the same episodes."""

from __future__ import annotations

import numpy as np

import cps_envs
from cps_envs.core.types import FloatArray

SHORT = {"duration_s": 30.0, "num_platoons": 4, "attack_budget": 1, "quiet_share": 0.0, "earliest_attack_s": 1}


def test_the_neutral_action_gains_nothing_over_itself() -> None:
    env = cps_envs.learning_env("DisbandingDefense", 3, adapter="follow_road", frame_skip=75, relative=True, **SHORT)
    env.reset()
    returns = []
    for _ in range(12):
        _, reward, ended, _, info = env.step(np.zeros((3, 22)))
        assert not reward.any()
        if ended.any():
            returns.append(info["final_info"]["episode"]["r"][ended])
    assert len(np.unique(np.concatenate(returns))) > 3, "episodes differ, and returns are what they are"


def test_relative_pay_is_the_difference_of_two_returns() -> None:
    def gained(action: float, relative: bool) -> FloatArray:
        options = {"adapter": "follow", "frame_skip": 300, "relative": relative, **SHORT}
        env = cps_envs.learning_env("DisbandingDefense", 2, seed=1, **options)
        env.reset()
        return np.stack([env.step(np.full((8, 22), action))[1] for _ in range(3)])

    difference = gained(0.3, relative=False) - gained(0.0, relative=False)
    assert np.abs(difference).max() > 0.01
    np.testing.assert_allclose(gained(0.3, relative=True), difference, atol=1e-9)
