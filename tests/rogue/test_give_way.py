"""The learnable interface of the defender: to whom all others give way."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.adapter import Adapter, adapter_of
from cps_envs.core.policies.policy import Policy
from cps_envs.core.types import Array, Role
from cps_envs.registration import find_problem, learning_env
from cps_envs.rogue.controllers import SLIDING
from cps_envs.rogue.give_way import CONFIRMED_S, GiveWay, GiveWayVehicle
from cps_envs.rogue.giving_way import NOBODY
from tests.episodes import seen_by
from tests.rogue.games import spec_of, started

FORMS = {"give_way": GiveWay, "give_way_vehicle": GiveWayVehicle}
LONG = round(CONFIRMED_S / 0.1)  # decisions
EPISODES = 256


def played(defender: str, seeds: range, attacker: str = "square") -> dict[str, Array]:
    problem = find_problem("rogue")
    players: dict[Role, str | Policy] = {"attacker": attacker, "defender": defender}
    return play_episodes(problem, problem.config("learning", {}), players, seeds)


def returns(adapter: str, action: int | None) -> Array:
    """Of whole episodes against whom learners meet: under one action of all agents, or under a uniform policy."""
    envs, drawn = learning_env("RogueDefense", num_envs=EPISODES, adapter=adapter), np.random.default_rng(0)
    found: list[float] = []
    envs.reset(seed=0)
    while len(found) < 2 * EPISODES:
        given = drawn.integers(0, 2, envs.num_envs) if action is None else np.full(envs.num_envs, action)
        *_, ended, _, info = envs.step(given)
        if ended.any():
            found += list(info["final_info"]["episode"]["r"][ended][:: envs.agents])
    return np.array(found[EPISODES:])  # without those that began before the actions did


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("attacker", ["none", "square", "contested?against=sliding"])
def test_the_neutral_action_is_none_bit_for_bit(name: str, attacker: str) -> None:
    neutral, none = (played(each, range(8), attacker) for each in (f"always?adapter={name}&action=0", "none"))
    for part in ("return", "damage", "formation_charge"):
        np.testing.assert_array_equal(neutral[part], none[part])


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMS)
def test_a_uniform_policy_returns_at_most_about_twice_what_none_does(name: str) -> None:
    none = returns(name, 0).mean()
    assert none < 0
    assert returns(name, None).mean() >= 2.2 * none


def driven(adapter: Adapter, seeds: range, says: list[Array]) -> list[tuple[Array, Array]]:
    """Who is given way (B,) and the orders (B, 2 n) after each of the agents' actions (B, A)."""
    game, state, found = started(seeds, "learning"), adapter.begin(len(seeds)), []
    for actions in says:
        orders, state = adapter.act(seen_by(game, adapter), state, actions)
        found.append((state[-1], orders))
        game.advance({"defender": orders}, np.ones(len(seeds), np.bool_), 1)
    return found


def asked(*vehicles: int) -> Array:
    """The actions (1, 8) of a team in which these ask."""
    return np.isin(np.arange(8), vehicles).astype(np.int64)[np.newaxis]


def test_one_at_a_time_the_first_stays_and_another_asks_for_a_second_without_a_break() -> None:
    adapter = GiveWayVehicle(spec_of("defender", preset="learning"))
    says = [asked(1)] * LONG + [asked()] + [asked(1)] * (LONG + 1) + [asked(1, 2)] * 5 + [asked(2)] * (LONG + 1)
    found = driven(adapter, range(1), says)
    given = [int(who[0]) for who, _ in found]
    first = 2 * LONG + 1
    assert given[:first] == [NOBODY] * first  # the break counts
    assert given[first : first + 6] == [1] * 6  # also while another one asks
    assert set(given[first + 6 :]) <= {NOBODY, 2}
    assert given[-1] == 2
    for who, orders in found:
        assert (orders[0, ::2] == SLIDING).all() == (who[0] == NOBODY)


def test_absent_vehicles_are_not_given_way() -> None:
    adapter, seeds = GiveWayVehicle(spec_of("defender", preset="learning")), range(40)
    count = started(seeds, "learning").drawn["num_vehicles"]
    says = [np.tile(asked(7), (len(seeds), 1))] * (LONG + 1)
    given = driven(adapter, seeds, says)[-1][0]
    np.testing.assert_array_equal(given, np.where(count == 8, 7, NOBODY))


def test_one_agent_keeps_its_suspect_until_it_says_no() -> None:
    adapter, seeds = GiveWay(spec_of("defender", preset="learning")), range(6)
    yes, no = np.ones((len(seeds), 1), np.int64), np.zeros((len(seeds), 1), np.int64)
    given = [who for who, _ in driven(adapter, seeds, [yes] * 100 + [no])]
    assert (given[LONG - 1] == NOBODY).all()
    begun = given[60] != NOBODY
    assert begun.any()
    np.testing.assert_array_equal(given[60][begun], given[99][begun])
    assert (given[-1] == NOBODY).all()


@pytest.mark.parametrize("name", FORMS)
def test_states_are_pure_and_batches_are_single_episodes(name: str) -> None:
    def run(seeds: range) -> list[Array]:
        game = started(seeds, "learning")
        adapter = adapter_of(game.spec("defender"), name)
        state, drawn, found = adapter.begin(len(seeds)), np.random.default_rng(1), []
        for _ in range(40):
            seen = seen_by(game, adapter)
            rows, actions = adapter.observe(seen, state), np.tile(drawn.integers(0, 2, len(adapter.agents)), (3, 1))
            before = [part.copy() for part in state]
            orders, after = adapter.act(seen, state, actions[: len(seeds)])
            for part, kept in zip(state, before, strict=True):
                np.testing.assert_array_equal(part, kept)
            assert (np.abs(rows) <= 1).all()
            game.advance({"defender": orders}, np.ones(len(seeds), np.bool_), 1)
            state = after
            found += [rows[:1], orders[:1]]
        return found

    for one, many in zip(run(range(1)), run(range(3)), strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("form", FORMS.values())
def test_each_field_says_what_it_is_and_varies(form: type[Adapter]) -> None:
    adapter, seeds = form(spec_of("defender", preset="learning")), range(12)
    assert all(field.description for field in adapter.fields)
    game, state, found = started(seeds, "learning", onset_s=0.0, attack_share=1.0), adapter.begin(len(seeds)), []
    for decision in range(200):
        seen = seen_by(game, adapter)
        found.append(adapter.observe(seen, state))
        asks = np.full((len(seeds), len(adapter.agents)), decision // 30 % 2)
        orders, state = adapter.act(seen, state, asks)
        effort = np.full((len(seeds), 1), 1.0 if decision // 50 % 2 else -1.0)
        game.advance({"defender": orders, "attacker": effort}, np.ones(len(seeds), np.bool_), 1)
    assert (np.concatenate(found).reshape(-1, adapter.fields.size).std(axis=0) > 0).all()


@pytest.mark.parametrize("form", FORMS.values())
def test_it_needs_accelerations_beside_controllers(form: type[Adapter]) -> None:
    with pytest.raises(ConfigurationError, match="giving way needs"):
        form(spec_of("defender", preset="easy"))


def test_shared_pay_is_the_team_s_reward_for_each() -> None:
    own, shared = (
        learning_env("RogueDefense", num_envs=4, adapter="give_way_vehicle", shared_pay=each) for each in (False, True)
    )
    paid = []
    for envs in (own, shared):
        envs.reset(seed=3)
        paid.append(np.array([envs.step(np.zeros(envs.num_envs, np.int64))[1].reshape(4, -1) for _ in range(8)]))
    assert np.ptp(paid[0], axis=2).any()
    np.testing.assert_allclose(paid[1], np.repeat(paid[0].sum(axis=2, keepdims=True), 8, axis=2), atol=1e-9)
