"""The joint mitigation: its program against a dense solution, its policy against the bound and by its promises."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.joint import BEST, PAPER, Joint
from cps_baselines.disbanding.joint_program import (
    CAPS,
    PENALTIES,
    JointDesign,
    JointScratch,
    design_joint,
    joint_scratch,
    solve_joint,
)
from cps_baselines.disbanding.quadratic_program import quadratic_program
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.problem import DISBANDING
from tests.disbanding.programs import JointByLibrary, hildreth, joint_by_kernel
from tools.disbanding.bounds import TwoAttackSearch, least_error_of_two, least_errors

SETTINGS = replace(BEST, horizon=4, period_s=0.5, command_weight=0.2, gap_weight=0.3)
COUNT, TAU_S = 3, 0.3


def drive(commands: Array) -> tuple[Array, Array]:
    """Places and speeds (M, H) that commands (M, H) alone cause: fine Euler steps, no closed form."""
    vehicles, horizon = commands.shape
    x, v, a = np.zeros((3, vehicles))
    places, speeds, steps = [], [], 5000
    dt = SETTINGS.period_s / steps
    for m in range(horizon):
        for _ in range(steps):
            x, v, a = x + dt * v, v + dt * a, a + dt * (commands[:, m] - a) / TAU_S
        places.append(x)
        speeds.append(v)
    return np.array(places).T, np.array(speeds).T


def responses() -> tuple[Array, Array]:
    """The matrices (H, H) from one vehicle's commands to its places and speeds."""
    places, speeds = drive(np.eye(SETTINGS.horizon))
    return places.T, speeds.T


def dense_program() -> tuple[Array, tuple[Array, ...]]:
    """H and the rows (commands, speeds, gaps; lower limits negated) of the program for COUNT vehicles, from scratch."""
    place, speed = responses()
    one, chain = np.eye(COUNT), np.eye(COUNT, k=-1) - np.eye(COUNT)  # gap i = x(i - 1) - x(i)
    gaps, closings = np.kron(chain, place), np.kron(chain, speed)
    speeds = np.kron(one, speed)
    hessian = SETTINGS.command_weight * np.eye(COUNT * SETTINGS.horizon) + SETTINGS.speed_weight * speeds.T @ speeds
    hessian += SETTINGS.gap_weight * gaps.T @ gaps + SETTINGS.closing_weight * closings.T @ closings
    return hessian, (np.eye(len(hessian)), speeds, gaps)


def test_the_responses_are_those_of_a_vehicle_with_a_lag() -> None:
    design = design_joint(SETTINGS, TAU_S, COUNT)
    place, speed = responses()
    assert np.allclose(design.place, place, atol=2e-3)
    assert np.allclose(design.speed, speed, atol=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_program_is_solved_as_a_dense_one(seed: int) -> None:
    generator = np.random.default_rng(seed)
    shape = (COUNT, SETTINGS.horizon)
    scratch = joint_scratch(*shape)
    scratch.linear[:] = 3.0 * generator.standard_normal(shape)
    limits = generator.uniform([[[0.3]], [[0.3]], [[0.2]]], [[[1.0]], [[1.5]], [[2.0]]], (3, *shape))
    scratch.low[:], scratch.high[:] = -limits, limits[::-1]
    hessian, rows = dense_program()
    stacked = np.vstack([*rows, *(-row for row in rows)])
    bounds = np.concatenate([*(high.ravel() for high in scratch.high), *(-low.ravel() for low in scratch.low)])
    expected = hildreth(quadratic_program(hessian, stacked), scratch.linear.ravel(), bounds, (20_000, 1e-10))
    free = -np.linalg.solve(hessian, scratch.linear.ravel())
    assert (stacked @ free > bounds + 0.1).any()  # limits matter
    commands, multipliers = np.zeros(shape), np.zeros((3, *shape))
    design = design_joint(SETTINGS, TAU_S, COUNT)
    solve_joint(design, COUNT, commands, multipliers, 800, 1e-7, scratch)
    assert np.abs(multipliers[2]).max() < CAPS[2] / PENALTIES[2]  # else the dense program is another one
    assert np.allclose(commands.ravel(), expected, atol=5e-3)


def test_the_residual_says_how_far_the_solution_is() -> None:
    """Below it the first commands hold still; a program that ends early says so."""
    shape = (COUNT, SETTINGS.horizon)
    scratch, design = joint_scratch(*shape), design_joint(SETTINGS, TAU_S, COUNT)
    scratch.linear[:] = 3.0 * np.random.default_rng(0).standard_normal(shape)
    scratch.low[:], scratch.high[:] = -0.4, 0.6
    found = []
    for iterations, tolerance in ((2, 1e-3), (5000, 1e-3), (20_000, 1e-9)):
        commands, multipliers = np.zeros(shape), np.zeros((3, *shape))
        residual = solve_joint(design, COUNT, commands, multipliers, iterations, tolerance, scratch)
        assert (residual < tolerance) == (iterations > 2)
        found.append(commands[:, 0].copy())
    early, usual, exact = (np.abs(each - found[-1]).max() for each in found)
    assert early > 0.05 > 0.02 > usual > exact


def programs_met(platoons: int, decisions: Sequence[int]) -> Iterator[tuple[JointDesign, JointScratch, int]]:
    """Programs that `joint` meets in an episode of preset `paper`: design, limits and number of vehicles."""
    overrides = {"tau_s": TAU_S, "num_platoons": platoons, "control_period_s": 0.5, "attack_budget": 1}
    config = DISBANDING.config("paper", overrides)
    policy = Joint(DISBANDING.game(config, 1).spec("defender"))
    match = DISBANDING.match(config, 1, {"attacker": "lead", "defender": policy})
    match.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    count, steps = (platoons - 1) * config.vehicles_per_platoon, match.game.decision_interval["defender"]
    for decision in range(max(decisions) + 1):
        match.step({}, np.ones(1, np.bool_), steps)
        if decision in decisions:
            given = JointScratch(*(each.copy() for each in policy._scratch))
            yield design_joint(policy.settings, TAU_S, config.max_vehicles), given, count


def test_programs_of_an_episode_are_solved_as_osqp_does() -> None:
    bound = 0
    for design, given, count in programs_met(2, (5, 10, 20)):
        expected = JointByLibrary(design, BEST, count, 1e-4).solve(given)
        commands, multipliers = np.zeros(expected.shape), np.zeros((3, *expected.shape))
        assert joint_by_kernel(design, count, commands, multipliers, 50_000, 1e-6, given) < 1e-6
        np.testing.assert_allclose(commands, expected, atol=2e-3)
        bound += bool(multipliers[2].any())
    assert bound  # gaps matter


@pytest.mark.slow
def test_osqp_takes_more_than_twice_the_time_for_as_many_iterations() -> None:
    """Why `joint` does not call it: iterations of both come as near to the optimum, and both start warm."""
    iterations, spent, library, plan = 150, [], None, np.zeros((4, 90, BEST.horizon))
    for design, given, count in programs_met(10, range(20, 30)):
        library = library or JointByLibrary(design, BEST, count, 1e-9, iterations)
        started = time.process_time()
        joint_by_kernel(design, count, plan[0], plan[1:], iterations, 0.0, given)
        between = time.process_time()
        library.solve(given)
        spent.append((between - started, time.process_time() - between))
    ours_s, theirs_s = np.median(spent, axis=0)  # the first one compiles
    print(f"CPU time of a program: {1e3 * ours_s:.1f} ms, OSQP {1e3 * theirs_s:.1f} ms")
    assert theirs_s > 2.0 * ours_s


def test_an_episode_tells_the_residual_of_its_last_programs() -> None:
    spec = DISBANDING.game(DISBANDING.config("paper", {}), 1).spec("defender")
    policy = Joint(spec)
    state = policy.begin([None], [{"truth": {}}])
    assert policy.beliefs(state)["residual"].tolist() == [0.0]


def test_a_row_that_cannot_be_kept_gives_way() -> None:
    shape = (COUNT, SETTINGS.horizon)
    scratch = joint_scratch(*shape)
    scratch.linear[:], scratch.low[:], scratch.high[:] = 0.0, -30.0, np.inf
    scratch.low[0], scratch.high[0] = -5.0, 1.0
    scratch.low[2], scratch.low[2, 0] = 0.0, 20.0  # no braking of 2 s opens 20 m ahead of the leader
    commands, multipliers = np.zeros(shape), np.zeros((3, *shape))
    solve_joint(design_joint(SETTINGS, TAU_S, COUNT), COUNT, commands, multipliers, 4000, 1e-6, scratch)
    assert np.isfinite(commands).all()
    assert np.allclose(commands[:, 0], -5.0, atol=0.2)


def test_a_row_that_gives_way_is_charged_its_price() -> None:
    """The optimality conditions of the program with 300 per metre, from dense matrices: stationary, complementary."""
    shape, settings = (COUNT, SETTINGS.horizon), SETTINGS
    scratch = joint_scratch(*shape)
    scratch.linear[:], scratch.low[:], scratch.high[:] = -1.0, -np.inf, np.inf
    scratch.low[0], scratch.high[0] = -5.0, 1.0
    scratch.low[2], scratch.low[2, 0, -1] = 0.0, 10.0  # out of reach
    commands, multipliers = np.zeros(shape), np.zeros((3, *shape))
    solve_joint(design_joint(settings, TAU_S, COUNT), COUNT, commands, multipliers, 20_000, 1e-8, scratch)
    hessian, rows = dense_program()
    prices = [penalty * each for penalty, each in zip(PENALTIES, multipliers, strict=True)]
    slope = hessian @ commands.ravel() + scratch.linear.ravel()
    slope += sum(row.T @ price.ravel() for row, price in zip(rows, prices, strict=True))
    assert np.abs(slope).max() < 0.5  # of prices up to 300; `dense_program` drives by Euler steps
    gaps = (rows[2] @ commands.ravel()).reshape(shape)
    missing = scratch.low[2] - gaps
    assert (missing > 0.5).any()
    assert np.allclose(-prices[2][missing > 0.01], CAPS[2])
    assert np.allclose(prices[2][missing < -0.01], 0.0)


@pytest.mark.slow
def test_the_wishes_of_a_long_string_do_not_break_the_first_gap() -> None:
    """Every vehicle wants to go faster. What the first gap costs then is what all of them want, not what one does."""
    settings, count = replace(SETTINGS, horizon=2), 50
    shape = (count, settings.horizon)
    scratch = joint_scratch(*shape)
    scratch.linear[:] = -2.0
    scratch.low[:], scratch.high[:] = -np.inf, np.inf
    scratch.low[2] = 0.0
    commands, multipliers = np.zeros(shape), np.zeros((3, *shape))
    solve_joint(design_joint(settings, TAU_S, count), count, commands, multipliers, 1000, 1e-6, scratch)
    assert scratch.rows[2, 0].min() > -0.6  # at a price of 30 a dense solution leaves 1.2 m, at 300 0.52 m
    assert -PENALTIES[2] * multipliers[2, 0].min() > 50.0


def play(
    attacker: str, defender: str, seeds: Sequence[int] = (0,), preset: str = "paper", **overrides: Any
) -> tuple[DisbandingConfig, dict[str, Array]]:
    """Under decisions every half second, which show what decisions every 0.1 s do at a fifth of their price."""
    config = DISBANDING.config(preset, {"report": "safety", "control_period_s": 0.5, **overrides})
    return config, play_episodes(DISBANDING, config, {"attacker": attacker, "defender": defender}, seeds)


def test_it_comes_within_half_a_point_of_the_bound_at_its_own_gap() -> None:
    config, outcome = play("lead", "joint", tau_s=0.5, attack_budget=1)  # one attack, so no reserve is kept
    assert outcome["collided"][0] == 0
    assert outcome["smallest_gap_m"][0] > BEST.least_gap_m - 0.5
    bound = least_errors(config, outcome["smallest_gap_m"])["velocity_error_intact"][0]
    assert bound - 1e-6 <= outcome["velocity_error_intact"][0] < bound + 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("tau_s", "desired_gap_m"), [(0.1, 4.0), (0.5, 5.0)])
def test_a_second_attack_finds_room_and_costs_less_than_under_string(tau_s: float, desired_gap_m: float) -> None:
    overrides = {"tau_s": tau_s, "desired_gap_m": desired_gap_m}
    (config, outcome), (_, reference) = (play("table_2_3", defender, **overrides) for defender in ("joint", "string"))
    bound = least_error_of_two(config, outcome["smallest_gap_m"], search=TwoAttackSearch(generations=10))
    assert outcome["velocity_error_all"][0] >= bound[0]
    assert outcome["collided"][0] == 0
    assert outcome["smallest_gap_m"][0] > 1.0
    assert outcome["velocity_error_all"][0] < reference["velocity_error_all"][0]


@pytest.mark.slow
def test_leaders_keep_a_reserve_only_while_an_attack_may_come() -> None:
    """E_v behind platoon 10, disbanded at 1 s, when that is the only attack and when one may follow."""
    errors = []
    for budget in (1, 2):
        _, outcome = play("lead", "joint", duration_s=60.0, attack_budget=budget)
        errors.append(outcome["velocity_error_intact"][0])
    assert errors[0] < errors[1] - 1.0


def test_without_an_attack_it_does_nothing() -> None:
    _, outcome = play("none", "joint", (1, 2), "learning", duration_s=20.0)
    _, untouched = play("none", "none", (1, 2), "learning", duration_s=20.0)
    assert np.array_equal(outcome["return"], untouched["return"])


def test_episodes_of_a_batch_do_not_know_of_one_another() -> None:
    both = play("lead", "joint", (3, 4), "learning", duration_s=12.0, quiet_share=0.0, earliest_attack_s=1)[1]
    alone = play("lead", "joint", (4,), "learning", duration_s=12.0, quiet_share=0.0, earliest_attack_s=1)[1]
    assert both["return"][1] == alone["return"][0]


def test_it_declares_that_it_is_told_and_refuses_what_it_cannot_do() -> None:
    spec = DISBANDING.game(DISBANDING.config("learning", {}), 1).spec("defender")
    assert resolve_policy("joint", spec).privileged == {"truth"}
    assert resolve_policy("joint?weights=paper", spec).settings == PAPER
    with pytest.raises(ConfigurationError, match="papr"):
        resolve_policy("joint?weights=papr", spec)
    platoons = DISBANDING.game(DISBANDING.config("learning", {"defense_action": "platoon"}), 1).spec("defender")
    with pytest.raises(ConfigurationError, match="defense_action"):
        Joint(platoons)


def test_the_plan_survives_a_collision_of_its_own_making() -> None:
    """Finite actions where gaps are negative: ghosts pass through one another."""
    spec = DISBANDING.game(DISBANDING.config("paper", {}), 1).spec("defender")
    policy = Joint(spec)
    motion = {name: np.zeros(100) for name in ("speed", "acceleration")}
    motion |= {"position": -np.arange(100.0), "disbanding_s": np.r_[1.0, np.full(9, np.inf)]}
    motion["position"][50] += 3.0
    seen = {"tau_s": np.array([0.3]), "desired_gap_m": np.array([5.0]), "law_command": np.zeros((1, 100))}
    state = policy.begin([None], [{"truth": motion}])
    actions, _ = policy.act(Observed(seen), state)
    assert np.isfinite(actions).all()
    assert np.abs(actions).max() <= 1.0


class Observed(dict):
    """What a policy reads of one episode."""

    def __len__(self) -> int:
        return 1
