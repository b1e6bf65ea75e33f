"""Certificates of single episodes whose start and gains were drawn, against the game and the oracle from rest."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from cps_baselines.fdi.cross import cross
from cps_baselines.fdi.sweep import certify, certify_all, instance_of, own_config
from cps_envs.core.errors import ConfigurationError
from cps_envs.fdi.problem import FDI
from tests.fdi.episodes import play

SHORT = {"horizon": 22, "tasks": "v4>4 x4>4"}
CONFIG = FDI.config("drawn", SHORT)


def test_an_instance_is_what_its_seed_draws() -> None:
    env = gymnasium.make("cps_envs:cps_envs/FdiAttack-v0", preset="drawn", opponent="none", **SHORT).unwrapped
    for seed in range(5):
        observation, _ = env.reset(seed=seed)
        shown, found = env.game.fields["attacker"].decode(observation), instance_of(CONFIG, seed)
        np.testing.assert_allclose(
            np.concatenate([shown["gap_error"], shown["relative_speed"]]), found.start, atol=1e-5
        )
        np.testing.assert_allclose(shown["gain"] * [1, 3], found.gains, atol=1e-5)
        assert env.game.task(0) == str(found.task)
        assert 0.8 <= found.gains[0] <= 1.2
    assert instance_of(CONFIG, 0) != instance_of(CONFIG, 1)


@pytest.mark.parametrize("seed", [3, 4])
def test_the_game_pays_the_value_of_a_certificate(seed: int) -> None:
    certificate = certify(CONFIG, instance_of(CONFIG, seed), time_limit_s=2.0)
    record = certificate.record
    assert record.injections is not None
    assert 0 < record.value_mps <= record.bound_mps <= record.lp_mps + 1e-9
    env = gymnasium.make("cps_envs:cps_envs/FdiAttack-v0", preset="drawn", opponent="none", **SHORT).unwrapped
    env.reset(seed=seed)
    slots = np.flatnonzero(certificate.instance.task.sensors.flags(4))
    paid, terminated = 0.0, False
    for level in record.injections:
        assert not terminated
        action = env.game.neutral_action["attacker"].copy()
        action[slots] += level
        _, reward, terminated, _, info = env.step(action)
        paid += reward
    assert terminated
    assert info["illegal"] == 0
    assert paid == pytest.approx(record.value_mps, abs=1e-6)


def test_nobody_exceeds_a_bound() -> None:
    seeds = range(4)
    bounds = [certify(CONFIG, instance_of(CONFIG, seed), time_limit_s=1.0).record.bound_mps for seed in seeds]
    for attacker in ("random", "bang_bang", "bang_bang?stickiness=0.95", "swing?swing_s=0.5"):
        assert (play(attacker, seeds=seeds, preset="drawn", **SHORT)["return"] <= np.array(bounds) + 1e-5).all()


def test_from_rest_the_optimum_is_that_of_the_oracle() -> None:
    still = FDI.config("drawn", {"horizon": 19, "tasks": "v4>4", "gap_spread_m": 0.0, "speed_spread_mps": 0.0})
    instance = instance_of(still, 0)
    own = own_config(still, instance)
    found, expected = certify(still, instance, time_limit_s=20.0).record, cross(own, instance.task, 20.0)
    assert found.status == expected.status == "proved"
    assert found.bound_mps == pytest.approx(expected.bound_mps, abs=1e-3)


def test_several_are_certified_at_a_time() -> None:
    found = {one.instance.seed: one for one in certify_all(CONFIG, [3, 4], time_limit_s=1.0, jobs=2)}
    assert set(found) == {3, 4}
    assert found[3].instance == instance_of(CONFIG, 3)


def test_what_cannot_be_certified_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='preset "drawn"'):
        instance_of(FDI.config("learning", {}), 0)
