"""The game on the kernels: physics, legality, ends, payoff, what the defender does and sees."""

from __future__ import annotations

from functools import partial
from itertools import chain
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.compute.kernels import records
from cps_envs.core.types import ROLES, Array, Role
from cps_envs.fdi.filtered import filtered_fields
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.observation import fill_masks
from cps_envs.fdi.payoff import Metrics, collide
from cps_envs.fdi.problem import FDI
from cps_paper.fdi.interpretations import FIGURE, INTERPRETATIONS
from tests import episodes
from tests.fdi.reference import Platoon

SENSORS = ("x1", "v4", "xv2", "x1+v3", "xv1,4")
CLIP = INTERPRETATIONS["clip"]
started = partial(episodes.started, FDI)


def go(
    game: FdiGame, levels: Array | list[int], trust: Array | None = None, correction: Array | list[int] | None = None
) -> Array:
    """One step under levels (S,) of every environment, and the defender's trust (2n,) and correction levels (n,)."""
    bounds = game.neutral_action["attacker"]
    actions = {"attacker": np.tile(np.asarray(levels) + bounds, (game.num_envs, 1))}
    if trust is not None or correction is not None:
        n, none = game.config.num_vehicles, game.config.correction_levels
        doubts = np.ones(2 * n, int) if trust is None else np.asarray(trust)
        held = np.full(n, none) if correction is None else none + np.asarray(correction)
        actions["defender"] = np.tile(np.concatenate([doubts, held]), (game.num_envs, 1))
    return game.advance(actions, ~game.terminated, 1)


def seen(game: FdiGame, role: Role) -> dict[str, Array | float]:
    return {name: values[0] for name, values in game.fields[role].decode(game.observe(role)).items()}


def legal_level(game: FdiGame, generator: np.random.Generator) -> Array:
    low, high = game.state.legal[0].T
    return generator.integers(low, np.maximum(low, high) + 1)


@pytest.mark.parametrize("attacked", SENSORS)
def test_hard_limits_follow_the_continuous_platoon(attacked: str) -> None:
    game, generator = started(attacked=attacked, target=1), np.random.default_rng(1)
    platoon = Platoon(game.config)
    for _ in range(game.horizon):
        go(game, legal_level(game, generator))
        if game.terminated[0]:
            break
        platoon.step_continuous(game.episode(0).injection)
        np.testing.assert_allclose(game.episode(0).error, platoon.errors, atol=1e-9)


@pytest.mark.parametrize("attacked", SENSORS)
def test_clipped_limits_follow_held_commands(attacked: str) -> None:
    game, generator = started(**CLIP, attacked=attacked, target=1), np.random.default_rng(2)
    platoon, none = Platoon(game.config), game.config.correction_levels
    while not game.terminated[0] and game.elapsed[0] < game.horizon:
        correction = generator.integers(-none, none + 1, 4)
        go(game, legal_level(game, generator), correction=correction)
        platoon.step_held(game.episode(0).injection, correction * game.config.max_correction_mps2 / none)
        np.testing.assert_allclose(game.episode(0).error, platoon.errors, atol=1e-9)


def test_disturbances_act_on_the_vehicles() -> None:
    game = started(**CLIP, attacked="x1", target=1, disturbance_mps2=0.5)
    disturbances = np.random.default_rng(0)
    disturbances.integers(1), disturbances.uniform(size=8)
    pushes, platoon = disturbances.normal(0, 0.5, (game.horizon, 4)), Platoon(game.config)
    for push in pushes:
        go(game, [0])
        platoon.step_held(np.zeros(8), disturbance=push)
        np.testing.assert_allclose(game.episode(0).error, platoon.errors, atol=1e-9)


def test_legal_levels_at_rest() -> None:
    """Spec 7.4: 21 levels for a range sensor, 13 for a range-rate sensor."""
    assert started(attacked="x1", target=1).state.legal[0].tolist() == [[-10, 10]]
    assert started(attacked="v4", target=4).state.legal[0].tolist() == [[-6, 6]]


@settings(max_examples=60)
@given(st.sampled_from(SENSORS), st.integers(0, 2**31), st.integers(0, 15))
def test_the_mask_is_what_the_constraints_say(attacked: str, seed: int, steps: int) -> None:
    """A level is offered exactly if it, with the best help of the other sensors, satisfies (3.48) to (3.50)."""
    game, generator = started(attacked=attacked, target=1), np.random.default_rng(seed)
    for _ in range(steps):
        go(game, legal_level(game, generator))
    if game.terminated[0]:
        return
    config, error, model = game.config, game.episode(0).error, game.config.model
    sensors = np.flatnonzero(game.tasks[0].sensors.flags(4))
    size = np.where(sensors < 4, config.range_resolution_m, config.rate_resolution_mps)
    boxes = [
        np.array(
            [z for z in range(-bound, bound + 1) if j >= 4 or error[j] + z * r >= -config.desired_gap_m - SLACK / 2]
        )
        for j, bound, r in zip(sensors, game.neutral_action["attacker"], size, strict=True)
    ]
    base, pull = model.feedback @ error, model.readings[:, sensors] * size
    for s, box in enumerate(boxes):
        possible = np.ones(len(box), bool)
        for i in range(4):
            if not pull[i].any():
                continue
            others = [pull[i, k] * other[[0, -1]] for k, other in enumerate(boxes) if k != s]
            low = base[i] + pull[i, s] * box + sum(part.min() for part in others)
            high = base[i] + pull[i, s] * box + sum(part.max() for part in others)
            possible &= (high >= config.min_acceleration_mps2 - SLACK / 2) & (
                low <= config.max_acceleration_mps2 + SLACK / 2
            )
        low, high = game.state.legal[0, s]
        assert box[possible].tolist() == list(range(low, high + 1))


def test_an_illegal_injection_ends_the_episode_unpaid() -> None:
    game = started(attacked="x1", target=1)
    assert go(game, [11])[0] == 0
    assert game.terminated[0]
    assert game.metrics()["illegal"][0] == 1
    assert not game.episode(0).error.any()


def test_a_dead_end_offers_no_injection() -> None:
    game = started(attacked="x4", target=3)
    for level in (-10, 20, -30, 40):
        low, high = game.state.legal[0, 0]
        go(game, [max(low, min(high, level))])
        if game.state.legal[0, 0, 0] > game.state.legal[0, 0, 1]:
            assert np.flatnonzero(game.action_mask("attacker")[0]).tolist() == game.neutral_action["attacker"].tolist()
            go(game, [0])
            assert game.metrics()["illegal"][0] == 1


def collision(target: int = 4, **overrides: Any) -> tuple[FdiGame, float]:
    """Brake, then accelerate as hard as is legal, until somebody collides."""
    game, total = started(attacked="x4", target=target, **overrides), 0.0
    for step in range(game.horizon):
        low, high = game.state.legal[0, 0]
        total += go(game, [low if step < 7 else high])[0]
    return game, total


def test_impact_speed_is_paid_at_the_crossing() -> None:
    game, total = collision()
    memory, metrics = game.episode(0), game.metrics()
    assert memory.error[3] <= -5 + SLACK
    assert total == metrics["impact_speed_mps"][0] == -memory.error[7] > 3
    assert metrics["collided_target"][0] == metrics["collided_pairs"][0] == 1
    assert total <= metrics["oracle_bound_mps"][0]


def test_another_pairs_collision_pays_only_where_any_pair_does() -> None:
    unpaid, paid = collision(target=3), collision(target=3, paid_pair="any")
    assert unpaid[1] == 0 < unpaid[0].metrics()["worst_impact_mps"][0] == paid[1]
    assert paid[0].metrics()["bound_valid"][0] == 0


def test_an_untrusted_range_is_replaced_by_the_rear_sensor() -> None:
    game = started(**CLIP, attacked="x1", target=1)
    trust = np.ones(8, int)
    trust[0] = 0
    for _ in range(10):
        go(game, [-10], trust=trust)
    assert not game.episode(0).error.any()
    np.testing.assert_allclose(seen(game, "defender")["redundancy_residual"], [-5, 0, 0], atol=1e-5)
    metrics = game.metrics()
    assert metrics["replaced_share"][0] == pytest.approx(1 / 8)
    assert metrics["false_alarm_rate"][0] == 0
    assert metrics["alarm_cost_mps"][0] == pytest.approx(10 * 0.1 * game.config.alarm_cost_mps2)


@pytest.mark.parametrize(("overrides", "disturbed"), [({}, False), (CLIP, False), (CLIP, True)])
def test_the_model_predicts_what_it_can_know(overrides: dict[str, Any], disturbed: bool) -> None:
    """Without disturbance, and with readings that are true or not used, the prediction is the truth."""
    noise = {"disturbance_mps2": 0.2} if disturbed else {}
    game, generator = started(**overrides, attacked="xv4", target=4, **noise), np.random.default_rng(3)
    trust = np.ones(8, int)
    trust[[3, 7]] = 0
    for _ in range(15):
        before = game.episode(0).error.copy()
        go(game, np.clip(legal_level(game, generator), -4, 4), trust=trust, correction=generator.integers(-2, 3, 4))
        off = np.abs(game.episode(0).prediction - before).max()
        assert off < 1e-9 or disturbed
    assert (off > 1e-4) == disturbed


def test_trust_and_no_correction_change_nothing() -> None:
    generator, plain, watched = np.random.default_rng(4), started(attacked="v1"), started(attacked="v1")
    for _ in range(12):
        level = legal_level(plain, generator)
        go(plain, level)
        go(watched, level, trust=np.ones(8, int))
        np.testing.assert_array_equal(plain.episode(0).error, watched.episode(0).error)
    assert watched.metrics()["bound_valid"][0] == plain.metrics()["bound_valid"][0]


def test_a_defender_who_acts_voids_the_bound() -> None:
    game = started()
    assert game.metrics()["bound_valid"][0] == 1
    go(game, [0], correction=[0, 1, 0, 0])
    assert game.metrics()["bound_valid"][0] == 0
    assert game.metrics()["correction_cost_mps"][0] == pytest.approx(0.01 * 0.2 * 0.5 / 4)


def test_kinematic_residual_shows_a_change_of_range_only() -> None:
    game = started(**CLIP, attacked="x2", target=2)
    go(game, [0])
    go(game, [-4])
    assert seen(game, "defender")["kinematic_residual"][1] == pytest.approx(-2.0, abs=1e-4)
    go(game, [-4])
    assert abs(seen(game, "defender")["kinematic_residual"][1]) < 0.02


def test_drawn_tasks_are_observed_and_masked() -> None:
    game = started(seeds=range(64), preset="easy")
    shown = game.fields["attacker"].decode(game.observe("attacker"))
    masks = np.split(game.action_mask("attacker"), np.cumsum(game.action_space["attacker"].nvec)[:-1], axis=1)
    for b in range(64):
        task = game.tasks[game.state.task[b]]
        assert str(task) == game.task(b)
        assert (shown["attacked"][b] > 0.5).tolist() == task.sensors.flags(4).tolist()
        assert shown["target"][b].argmax() + 1 == task.target
        free = [part[b].sum() > 1 for part in masks]
        assert free == task.sensors.flags(4).tolist()
    assert len({game.task(b) for b in range(64)}) > 20


def test_the_attacker_sees_true_errors_what_they_command_and_its_injection() -> None:
    """Where tasks are drawn an injection has an entry for each sensor, else for the attacked ones."""
    for preset, overrides in (
        ("defense", {"tasks": "xv4>4 v1>1 x2>2"}),
        ("paper", {**CLIP, "attacked": "x1,3+v4", "target": 3}),
    ):
        game, generator = started(seeds=range(12), preset=preset, **overrides), np.random.default_rng(2)
        for _ in range(4):
            go(game, generator.integers(-2, 3, len(game.neutral_action["attacker"])))
        state, c, model = game.state, game.config, game.config.model
        view = game.fields["attacker"].decode(game.observe("attacker"))
        share = state.injection / np.repeat([c.max_range_injection_m, c.max_rate_injection_mps], 4)
        drawn = preset == "defense"
        tasks = [game.tasks[task] for task in state.task]
        expected = {
            "gap_error": state.error[:, :4],
            "relative_speed": state.error[:, 4:],
            "command": state.error @ model.feedback.T,
            "injection": share if drawn else share[:, [0, 2, 7]],
            "steps_left": np.full(12, c.horizon - 4),
        }
        if drawn:
            expected["attacked"] = np.array([task.sensors.flags(4) for task in tasks])
            expected["target"] = np.eye(4)[[task.target - 1 for task in tasks]]
        assert state.injection[:, 7].any()  # which others do not see
        assert {name for name, values in view.items() if values.size} == expected.keys()
        for name, values in expected.items():
            np.testing.assert_allclose(view[name], values, atol=1e-4, err_msg=name)


def test_the_largest_injections_are_seen_as_one() -> None:
    game = started(**CLIP, attacked="xv1", target=1, limit_commands=False, limit_readings=False)
    for sign in (-1, 1):
        go(game, sign * game.neutral_action["attacker"])
        assert game.observe("attacker")[0, game.fields["attacker"].slices["injection"]].tolist() == [sign, sign]


def test_the_defender_sees_what_is_reported_and_how_far_it_lies_off_the_model() -> None:
    game, generator = started(**CLIP, attacked="xv2", target=2), np.random.default_rng(6)
    for _ in range(6):
        go(game, generator.integers(-3, 4, 2), generator.integers(0, 2, 8), generator.integers(-2, 3, 4))
    state, off = game.episode(0), game.episode(0).reading - game.episode(0).prediction
    expected = {
        "range_error": state.reading[:4],
        "range_rate": state.reading[4:],
        "range_innovation": off[:4],
        "rate_innovation": off[4:],
        "kinematic_residual": state.residual,
        "redundancy_residual": (state.reading[:4] - state.rear)[:3],
        "command": state.command,
        "trust": state.trust,
        "steps_left": game.horizon - 6,
    }
    view = {name: values for name, values in seen(game, "defender").items() if np.size(values)}
    assert view.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_allclose(view[name], values, atol=1e-4, err_msg=name)
        assert np.any(values), name


def test_observations_reach_as_far_as_what_they_show() -> None:
    """Four desired gaps and 20 m/s, and what an injection adds to them; commands without injection four limits."""
    game = started(**INTERPRETATIONS["B"], max_range_injection_m=7.0, max_rate_injection_mps=3.0)
    duel = started(preset="learning")
    reach = {
        "attacker": {"gap_error": 20, "relative_speed": 20, "command": 32, "injection": 1},
        "defender": {"range_error": 27, "range_rate": 23, "range_innovation": 27, "rate_innovation": 23}
        | {"kinematic_residual": 27, "redundancy_residual": 27, "command": 8},
    }
    for role in ROLES:
        bounds = {field.name: (field.low, field.high) for field in game.fields[role] if field.size}
        assert bounds.pop("steps_left") == (0, 20)
        assert bounds.pop("trust", (0, 1)) == (0, 1)
        assert bounds == {name: (-most, most) for name, most in reach[role].items()}
    counts = {"steps_left": 100, "wait": 100, "attacked": 1, "target": 1, "trust": 1}
    bounds = {field.name: (field.low, field.high) for field in duel.fields["attacker"] if field.name in counts}
    assert bounds == {name: (0, most) for name, most in counts.items()}
    assert list(duel.fields["defender"]) == list(filtered_fields(duel.config))


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=5))
def test_masks_offer_the_legal_levels_of_each_sensor_in_turn(sensors: Any) -> None:
    """Of a sensor without a legal level only no injection."""
    rows = [(bound, max(low, -bound), min(high, bound)) for bound, low, high in sensors]
    bounds, legal = np.array([row[0] for row in rows]), np.array([[row[1:] for row in rows]] * 2)
    legal[1] = 0
    masks = np.empty((2, int((2 * bounds + 1).sum())), np.int8)
    fill_masks(legal, bounds, masks)
    offered = [
        [int(low <= level <= high if low <= high else level == 0) for level in range(-bound, bound + 1)]
        for bound, low, high in rows
    ]
    assert masks[0].tolist() == [*chain(*offered)]
    assert masks[1].sum() == len(rows)


@pytest.mark.parametrize("overrides", [CLIP, FIGURE], ids=["clip", "fig32"])
def test_a_turn_of_several_steps_is_as_many_turns(overrides: dict[str, Any]) -> None:
    """Some environments collide on the way: they stand still from there on, and what is legal is that of their end."""
    whole, parts, steps = started(range(20), **overrides), started(range(20), **overrides), 30
    low, high = np.moveaxis(whole.state.legal, 2, 0)
    levels = np.random.default_rng(0).integers(low, high + 1)
    actions, envs = {"attacker": levels + whole.neutral_action["attacker"]}, np.ones(20, bool)
    payoff = whole.advance(actions, envs, steps)
    np.testing.assert_array_equal(payoff, sum(parts.advance(actions, envs, 1) for _ in range(steps)))
    assert 0 < whole.terminated.sum() < 20
    for name, values in whole.metrics().items():
        np.testing.assert_array_equal(values, parts.metrics()[name], err_msg=name)
    for name, values in whole.state._asdict().items():
        np.testing.assert_array_equal(values, getattr(parts.state, name), err_msg=name)
    np.testing.assert_array_equal(whole.terminated, parts.terminated)


def test_a_new_episode_trusts_every_reading_again() -> None:
    game = started(**CLIP, attacked="x1", target=1)
    go(game, [1], trust=np.zeros(8, int), correction=[1, 1, 1, 1])
    assert not game.state.trust.any()
    game.reset(np.ones(1, bool), [np.random.default_rng(0)])
    np.testing.assert_array_equal(game.state.trust, 1.0)
    for array in (game.state.injection, game.state.command, game.state.correction, game.state.residual):
        assert not array.any()


@pytest.mark.parametrize(("speed", "paid"), [(-0.05, 0.05), (0.05, 0.0)])
def test_an_impact_is_paid_by_its_speed(speed: float, paid: float) -> None:
    constants: Any = SimpleNamespace(desired_gap_m=4.0, pays_any=False)
    table = records(Metrics, 1).view(np.recarray)  # as plain Python needs them
    assert collide(np.array([-4.0, 0.0, speed, 0.0]), constants, 0, table)
    assert table[0]["impact_speed_mps"] == paid
    assert table[0]["worst_impact_mps"] == max(speed * -1, 0.0)
    assert (table[0]["collided_target"], table[0]["collided_pairs"]) == (1, 1)
