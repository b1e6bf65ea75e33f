"""What learners play the two roles through: three efforts, and a controller or all orders for each vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.types import Array, Role
from cps_envs.registration import learning_env
from cps_envs.rogue.adapters import EFFORTS, Effort, Vehicle, VehicleFull
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.fields import NEAR, compressed
from tests.episodes import seen_by
from tests.rogue.games import FIXED, go, spec_of, started

FORMS: dict[type[Adapter], Role] = {Effort: "attacker", Vehicle: "defender", VehicleFull: "defender"}


def rows(game: Any, adapter: Adapter) -> Array:
    return adapter.observe(seen_by(game, adapter), adapter.begin(game.num_envs))


def test_nine_of_ten_columns_vary_for_an_untrained_attacker() -> None:
    """Its neutral episodes show next to nothing but noise."""
    envs, generator = learning_env("RogueAttack"), np.random.default_rng(0)
    envs.reset()
    found: list[Array] = []
    for _ in range(30):
        envs.step(generator.integers(0, 3, envs.num_envs))
        found.append(rows(envs.game, envs.adapter)[:, 0])
    assert np.mean(np.concatenate(found).std(axis=0) >= 0.2) >= 0.9


@given(st.floats(-60, 60), st.floats(-60, 60))
def test_compressed_errors_keep_their_order_and_can_be_read(one: float, other: float) -> None:
    shown = compressed(np.array([one, other]))
    assert np.sinh(shown) * NEAR == pytest.approx([one, other], abs=1e-9)
    assert (shown[0] < shown[1]) == (one < other) or abs(one - other) < 1e-9


def test_efforts_are_those_of_the_engine() -> None:
    game, adapter = started((0, 1, 2), "learning", **FIXED, onset_s=0.0), Effort(spec_of("attacker", preset="learning"))
    native, _ = adapter.act(seen_by(game, adapter), (), np.array([[0], [1], [2]]))
    assert native.tolist() == [[-1], [0], [1]]
    speed = game.state.speed[:, 2].copy()
    game.advance({"attacker": native}, np.ones(3, bool), 1)
    gained = game.state.speed[:, 2] - speed
    assert gained[0] < -0.5
    assert gained[1] == pytest.approx(0, abs=1e-3)
    assert gained[2] > 0.1
    assert EFFORTS[adapter.neutral_action] == 0


def test_the_seized_vehicle_sees_its_own_sensors() -> None:
    game = started(range(20), "learning")
    go(game, -1.0, [1, 0] * 8, 200)
    adapter = Effort(game.spec("attacker"))
    shown = adapter.fields.decode(rows(game, adapter)[:, 0])
    told = seen_by(game, adapter)
    for field in adapter.fields:
        assert shown[field.name] == pytest.approx(np.clip(told[field.name], field.low, field.high), abs=1e-4), (
            field.name
        )


def test_an_effort_counts_from_the_onset_on() -> None:
    game = started(range(60), "learning")
    adapter = Effort(game.spec("attacker"))
    for _ in range(4):
        began = game.state.step >= game.drawn["onset_step"]
        assert np.array_equal(adapter.active(seen_by(game, adapter), ())[:, 0], began)
        go(game, 0.0, [1, 0] * 8, 100)
    assert began.any()
    assert not began.all()


def test_a_vehicle_chooses_its_controller_and_nothing_else() -> None:
    game = started((0, 1), "learning")
    adapter = Vehicle(game.spec("defender"))
    chosen = np.arange(16).reshape(2, 8) % len(CONTROLLERS)
    native, _ = adapter.act(seen_by(game, adapter), (), chosen)
    assert native[:, ::2].tolist() == chosen.tolist()
    assert not native[:, 1::2].any()
    assert CONTROLLERS[adapter.neutral_action] == "sliding"
    there = adapter.active(seen_by(game, adapter), ())
    assert there.sum(axis=1).tolist() == game.drawn["num_vehicles"].tolist()
    assert np.all(np.diff(there.astype(int), axis=1) <= 0)  # those that lack are the last


def test_a_vehicle_knows_how_near_the_ends_of_the_platoon_are() -> None:
    game = started((4,), "learning", **FIXED)
    adapter = Vehicle(game.spec("defender"))
    shown = adapter.fields.decode(rows(game, adapter))
    assert shown["trails"][0].tolist() == [1, 0, 0, 0, 0]
    assert shown["leads"][0].tolist() == [0, 0, 0, 0, 1]


@pytest.mark.parametrize("orders", ["intact", "all"])
@pytest.mark.parametrize("defense_action", ["mode", "command", "either"])
def test_all_orders_of_all_vehicles_are_the_role_s_action(orders: str, defense_action: str) -> None:
    game = started((0, 1, 2), "paper", orders=orders, defense_action=defense_action)
    adapter, space = VehicleFull(game.spec("defender")), game.action_space["defender"]
    agents = len(adapter.agents)
    chosen = np.stack([space.sample() for _ in range(3)])
    each = chosen.reshape(3, agents, *(adapter.action_space.shape or ()))
    assert all(adapter.action_space.contains(action) for action in each.reshape(3 * agents, -1))
    assert np.array_equal(adapter.act(seen_by(game, adapter), (), each)[0], chosen)
    neutral = np.tile(adapter.neutral_action, (1, agents, 1))
    assert np.array_equal(adapter.act(seen_by(game, adapter), (), neutral)[0][0], game.neutral_action["defender"])
    assert np.array_equal(rows(game, adapter), game.team("defender").observe())
    assert adapter.active(seen_by(game, adapter), ()).all()


def test_controllers_cannot_be_chosen_where_accelerations_are_ordered() -> None:
    with pytest.raises(ConfigurationError, match='defense_action="mode"'):
        Vehicle(spec_of("defender", defense_action="command"))


def test_what_is_always_the_same_takes_no_room() -> None:
    """In `paper` nothing is drawn: the adapters work there, with fewer columns."""
    for form, role in FORMS.items():
        game = started((0,), "paper", contact="solid")
        fixed, free = (form(spec_of(role, preset=preset)).fields.size for preset in ("paper", "learning"))
        assert rows(game, form(game.spec(role))).shape[2] == fixed
        assert fixed <= free
    assert Effort(spec_of("attacker")).fields.size == 8


@pytest.mark.parametrize("orders", ["intact", "all"])
def test_a_vehicle_knows_its_place(orders: str) -> None:
    game = started((0, 1), "learning", orders=orders, range_noise_m=0.0, num_vehicles=5, attacker_index=(1, 4))
    go(game, -1.0, None, 60)
    adapter, positions = Vehicle(game.spec("defender")), game.state.position
    reference = positions[:, -1:] + game.metrics()["reference_error_m"][:, np.newaxis]
    errors = reference - 9.0 * (4 - np.arange(5)) - positions
    if orders == "intact":
        others = np.arange(5) != game.drawn["attacker"][:, np.newaxis]
        errors = errors[others].reshape(2, 4)
    shown = adapter.fields.decode(rows(game, adapter).reshape(-1, adapter.fields.size))["place_error"]
    assert np.sinh(shown) * NEAR == pytest.approx(errors.ravel(), abs=0.5)
