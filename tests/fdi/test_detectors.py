"""The defenders, extensions beyond the paper: quiet without attack, and what they take from one."""

from __future__ import annotations

import numpy as np
import pytest

from cps_baselines.fdi.detectors import ROUNDING, FrontRearRedundancy, KinematicResidual, quiet_residual_m
from cps_baselines.fdi.model_fallback import ModelFallback
from cps_envs.core.types import Array
from cps_envs.fdi.optima import known
from cps_envs.fdi.problem import FDI
from cps_paper.fdi.interpretations import INTERPRETATIONS
from tests.episodes import observed
from tests.fdi.episodes import play, spec_of, task_settings, watched

CLIP = INTERPRETATIONS["clip"]

DETECTORS = ("kinematic", "redundancy", "model")
OWN = "x1>1 x2>2 v1>1 v4>4 xv4>4"  # listed, so that no shipped optima are needed


@pytest.mark.parametrize("defender", DETECTORS)
def test_no_false_alarm_without_attack_with_clipped_limits(defender: str) -> None:
    disturbed = {"gap_spread_m": 0.2, "speed_spread_mps": 0.2}
    for overrides in ({}, disturbed):
        outcome = play("none", defender, seeds=range(20), **CLIP, **overrides)
        assert outcome["false_alarm_rate"].max() == 0
        assert outcome["return"].max() == 0


@pytest.mark.parametrize("defender", DETECTORS)
def test_hardly_any_false_alarm_in_preset_defense(defender: str) -> None:
    outcome = play("none", defender, seeds=range(200), preset="defense", tasks=OWN)
    assert outcome["false_alarm_rate"].mean() < 0.02
    assert outcome["collided_pairs"].max() == 0


@pytest.mark.parametrize("defender", DETECTORS)
def test_larger_disturbances_are_no_alarm_either(defender: str) -> None:
    outcome = play("none", defender, seeds=range(50), preset="defense", tasks=OWN, disturbance_mps2=1.0)
    assert outcome["false_alarm_rate"].mean() < 0.02


@pytest.mark.parametrize(
    ("defender", "task", "cut"),
    [
        ("redundancy", "x1>1", True),
        ("redundancy", "v1>1", False),  # range-rates have no second sensor
        ("redundancy", "x4>4", False),  # nor has the lead's range
        ("kinematic", "x1>1", True),
        ("kinematic", "v4>4", True),
        ("model", "x4>4", True),
        ("model", "v1>1", True),
        ("model_only", "x4>4", True),
    ],
)
def test_what_is_left_of_the_replayed_optimum(defender: str, task: str, cut: bool) -> None:
    free, defended = (play("oracle", name, **CLIP, **task_settings(task)) for name in ("none", defender))
    assert free["impact_speed_mps"][0] > 3
    assert defended["illegal"][0] == 0
    if cut:
        assert defended["worst_impact_mps"][0] == 0
        assert defended["bound_valid"][0] == 0
    else:
        assert defended["worst_impact_mps"][0] == pytest.approx(free["worst_impact_mps"][0], abs=1e-9)


@pytest.mark.parametrize("name", ["A", "B", "clip"])
def test_vehicles_that_nobody_attacks_stay_below_the_kinematic_threshold(name: str) -> None:
    overrides = {**INTERPRETATIONS.get(name, {}), "attacked": "xv4", "target": 4}
    config = FDI.config("paper", overrides)
    residuals = watched(
        lambda game: np.abs([game.episode(b).residual[:3] for b in range(game.num_envs)]).max(),
        "bang_bang",
        seeds=range(50),
        **overrides,
    )
    assert max(residuals) <= quiet_residual_m(config) + ROUNDING
    assert quiet_residual_m(config) + max(residuals) < config.range_resolution_m  # one level is seen


def seen_by(defender: FrontRearRedundancy | KinematicResidual, residual_m: list[float], steps: int) -> Array:
    """Distrust (steps, 2n) while vehicle 1 shows the residuals (steps,) in m."""
    state, course = None, []
    for step in range(steps):
        residual = [residual_m[step] if step < len(residual_m) else 0.0]
        seen = observed(defender.spec, kinematic_residual=residual, redundancy_residual=residual)
        actions, state = defender.predict(seen, state)
        course.append(actions[0, :8] == 0)
    return np.array(course)


def test_a_kinematic_alarm_holds_and_is_released_when_the_offset_has_gone() -> None:
    spec = spec_of("defender", **CLIP)
    lasting = seen_by(KinematicResidual(spec, hold_s=0.5), [1.0], 20)
    assert np.all(lasting[:, 0])  # an offset that stays
    assert np.all(lasting[:6, 4])
    assert not lasting[6:, 4].any()
    gone = seen_by(KinematicResidual(spec, hold_s=0.5), [1.0, 0.0, -1.0], 20)
    assert np.all(gone[:8, [0, 4]])
    assert not gone[8:].any()
    assert not gone[:, [1, 2, 3, 5, 6, 7]].any()


def test_a_redundancy_alarm_holds_as_told() -> None:
    spec = spec_of("defender", **CLIP)
    course = seen_by(FrontRearRedundancy(spec, hold_s=0.3), [0.5], 10)
    assert np.all(course[:4, 0])
    assert not course[4:].any()
    assert not seen_by(FrontRearRedundancy(spec), [0.2], 5).any()  # below half a resolution


def test_the_gate_of_the_model_follows_the_disturbance() -> None:
    """The covariance against the spread of simulated double integrators whose readings are not used."""
    spec = spec_of("defender", preset="defense", tasks=OWN)
    defender, dt_s, generator = ModelFallback(spec), 0.1, np.random.default_rng(0)
    state, off = None, observed(spec, range_innovation=[20.0] * 4, rate_innovation=[20.0] * 4)  # not to be believed
    gap, speed = np.zeros((20_000, 4)), np.zeros((20_000, 4))
    for _ in range(30):
        actions, state = defender.predict(off, state)
        assert not actions[0, :8].any()
        deviation = generator.normal(0, 0.1, (20_000, 5))
        deviation[:, 4] = 0  # the reference
        relative = np.diff(deviation, axis=1)
        gap, speed = gap + dt_s * speed + dt_s**2 / 2 * relative, speed + dt_s * relative
    covariance = state[0]
    lead = np.sqrt(covariance[0, 3, 0])  # the other ranges are measured twice
    assert lead == pytest.approx(gap[:, 3].std(), rel=0.03)
    assert np.allclose(np.sqrt(covariance[0, :, 2]), speed.std(axis=0), rtol=0.03)


def test_memories_start_anew_with_each_episode() -> None:
    spec = spec_of("defender", **CLIP)
    for defender in (KinematicResidual(spec), FrontRearRedundancy(spec), ModelFallback(spec)):
        values = np.zeros((2, spec.fields.size))
        values[:, spec.fields.slices["rate_innovation"]] = 1.0  # m/s, which a wide gate lets pass
        rest = spec.fields.encode(values)
        dirty = (defender.blank(2) + 5,)
        actions, _ = defender.predict(rest, dirty, np.array([True, False]))
        fresh, _ = defender.predict(rest[:1])
        assert np.array_equal(actions[0], fresh[0])
        assert not np.array_equal(actions[1], fresh[0])


@pytest.mark.skipif(not known(FDI.config("paper", CLIP)), reason="no optima with clipped limits are shipped")
def test_the_defense_preset_with_its_own_opponent() -> None:
    attacker = FDI.opponents["defense"]["attacker"]
    free, defended = (play(attacker, name, seeds=range(60), preset="defense") for name in ("none", "model"))
    assert 0.3 < np.mean(free["injected_share"] > 0) < 0.7  # half of the episodes stay without attack
    assert defended["worst_impact_mps"].mean() < 0.2 * free["worst_impact_mps"].mean()
