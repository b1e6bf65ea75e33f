"""What learners play HVAC through: levels of innovation for the attacker, whom to believe for the defender."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs import learning_env
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter, adapter_of
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Role, State
from cps_envs.hvac.columns import squeeze, squeezed
from cps_envs.hvac.config import LEARNING
from cps_envs.hvac.expected import LEVELS
from cps_envs.hvac.houses import house
from cps_envs.hvac.neighbours import Neighbours, of_others
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets
from cps_envs.hvac.two_tests import FILLS
from tests.episodes import OnAct, Through
from tests.hvac.games import play, spec_of

NAMES: dict[Role, str] = {"attacker": "expected", "defender": "sensor"}
OTHERS: dict[Role, Role] = {"attacker": "defender", "defender": "attacker"}
HOUSES = ({}, {"num_sensors": 8}, house(9) | {"num_compromised": 2, "compromised_weights": ()})


def usual_adapter(role: Role, **overrides: Any) -> Adapter:
    return adapter_of(spec_of(role, **overrides), NAMES[role])


def episode(role: Role, index: int | None, days: int, on_act: OnAct | None = None, other: str = "", **rest: Any) -> Any:
    policy = Through(usual_adapter(role, **rest), index, on_act)
    players = {role: policy, OTHERS[role]: other or HVAC.opponents["learning"][OTHERS[role]]}
    return play(players["attacker"], players["defender"], range(days), "learning", **rest)


def at(level: float) -> int:
    return LEVELS.index(level)


@pytest.mark.slow
def test_lies_towards_cold_pay_most_and_none_pays_little() -> None:
    cold, warm, honest = (episode("attacker", at(level), 100)["return"].mean() for level in (-0.4, 0.4, 0.0))
    assert cold > 1.3 * warm > 2 * honest


@pytest.mark.parametrize("level", [-0.4, 0.2])
def test_the_filters_innovations_are_held_near_the_level(level: float) -> None:
    everybody, held = Neighbours(spec_of("attacker").config).everybody, []

    def keep(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        steady = (seen["attack_h"] > 3)[:, np.newaxis] & (seen["compromised"] > 0.5) & (np.abs(state[0]) < 11.9)
        held.append(seen["innovation"][:, everybody][steady])

    episode("attacker", at(level), 20, keep)
    share = np.concatenate(held).mean() / level  # what is missing makes the lie grow
    assert 0.7 < share < 1.0


def test_together_the_liars_hold_one_level_and_see_the_mean_of_their_rows() -> None:
    one, many = adapter_of(spec_of("attacker"), "together"), usual_adapter("attacker")

    def look(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        level = drawn[:, :1]
        alike, following = one.act(seen, state, level)
        np.testing.assert_array_equal(alike, many.act(seen, state, np.repeat(level, 4, axis=1))[0])
        np.testing.assert_array_equal(one.active(seen, following)[:, 0], many.active(seen, following).any(axis=1))
        rows, shown = many.observe(seen, state), one.observe(seen, state)
        for b, liars in enumerate(seen["compromised"] > 0.5):
            mean = rows[b, liars].mean(axis=0) if liars.any() else rows[b].mean(axis=0)
            np.testing.assert_allclose(shown[b, 0], mean, atol=1e-6)

    episode("attacker", None, 6, look, num_steps=120, window_steps=60, onset_step=70)


def test_only_compromised_sensors_lie_and_the_first_forged_reading_is_honest() -> None:
    def look(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        forges = (seen["compromised"] > 0.5) & (seen["active"] > 0.5)[:, np.newaxis]
        assert (action[:, -1] == 0).all()
        assert not action[:, :-1][~forges | (seen["attack_h"] == 0)[:, np.newaxis]].any()
        assert (np.abs(after[0]) <= 12).all()

    episode("attacker", None, 8, look)


def test_the_joint_belief_names_the_estimator_of_the_believed_sensors() -> None:
    adapter, sets = usual_adapter("defender"), sensor_sets(spec_of("defender").config)
    believed = np.array([[code >> shift & 1 for shift in (3, 2, 1, 0)] for code in range(16)])
    seen = Seen(adapter.spec.fields, np.ones((16, adapter.spec.fields.size), np.float32))
    choices, _ = adapter.act(seen, (), believed)
    assert choices[0] == len(sets) + 1  # the model
    assert choices[15] == adapter.spec.action_space.n - 2  # the filter of all
    for row, choice in zip(believed[1:15], choices[1:15], strict=True):
        assert sets[choice - 1] == tuple(np.flatnonzero(row) + 1)


def test_where_sets_are_few_the_largest_of_believed_sensors_is_chosen() -> None:
    adapter = usual_adapter("defender", sensor_sets=(1, 0, 1, 2, 0, 3, 4, 0, 2, 3, 4))
    seen = Seen(adapter.spec.fields, np.ones((3, adapter.spec.fields.size), np.float32))
    choices, _ = adapter.act(seen, (), np.array([[1, 1, 1, 0], [0, 1, 1, 1], [0, 1, 0, 0]]))
    assert choices.tolist() == [2, 4, 5]


@pytest.mark.parametrize("role", OTHERS)
@pytest.mark.parametrize("overrides", HOUSES)
def test_any_house_can_be_played_and_actions_are_legal(role: Role, overrides: dict[str, Any]) -> None:
    short = overrides | {"num_steps": 120, "window_steps": 60, "onset_step": 70}
    adapter = usual_adapter(role, **short)

    def look(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        assert np.isfinite(adapter.observe(seen, state)).all()
        if role == "defender":
            assert ((seen["ready"] > 0.5) | (action == len(sensor_sets(adapter.spec.config)) + 1)).all()

    episode(role, None, 2, look, {"attacker": "tracker", "defender": "largest"}[OTHERS[role]], **short)


@pytest.mark.parametrize(
    ("role", "overrides"),
    [
        ("attacker", {"kalman_filters": False}),
        ("attacker", {"attacker_view": "grey"}),
        ("defender", {"kalman_filters": False}),
        ("defender", {"sensor_sets": (1, 2, 0, 1, 3, 0, 1, 4)}),
        ("attacker", {"sensor_sets": (1, 2, 0, 1, 0, 2)}),
    ],
)
def test_where_filters_are_missing_the_adapters_refuse(role: Role, overrides: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        usual_adapter(role, **overrides)


def test_agents_are_active_where_an_action_has_an_effect() -> None:
    adapters = {role: usual_adapter(role) for role in NAMES}

    def attacker(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        assert not after[0][~adapters["attacker"].active(seen, state)].any()

    def defender(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        assert (adapters["defender"].active(seen, state).all(axis=1) == (seen["ready"] > 0.5)).all()

    episode("attacker", at(0.4), 4, attacker)
    episode("defender", 0, 2, defender)


def test_a_sensor_is_compared_with_itself_alone_and_with_all_others() -> None:
    spec: RoleSpec = spec_of("attacker")
    near, sets = Neighbours(spec.config), sensor_sets(spec.config)
    assert [sets[a] for a in near.alone] == [(1,), (2,), (3,), (4,)]
    assert [sets[a] for a in near.without] == [(2, 3, 4), (1, 3, 4), (1, 2, 4), (1, 2, 3)]
    assert near.member[near.everybody].all()
    assert not near.member[near.nobody].any()


def expected_rows(seen: Seen) -> dict[str, Array]:
    """Columns of the defender's agents, written from the text of `belief_fields`, for the usual four sensors."""
    i, m, x, r = seen["innovation"], seen["innovation_mean"], seen["estimate"] - 25.0, np.arange(4)
    j, jm, last = seen["residual"], seen["mean_residual"], seen["last_choice"].argmax(axis=1)
    without, alone, everybody, nobody = 15 - (8 >> r) - 1, (8 >> r) - 1, 14, 15
    chosen = np.select([last == 0, last < 15, last == 15], [np.full_like(last, 14), last - 1, last * 0 + 15], last - 16)
    members = np.array([*([code >> shift & 1 for shift in (3, 2, 1, 0)] for code in range(1, 15)), [1] * 4, [0] * 4])
    believed, m_all, m_model, m_without = members[chosen], m[:, everybody], m[:, nobody], m[:, without, r]

    def others(values: Array, kind: Callable[..., Array]) -> Array:
        return np.stack([kind(np.delete(values, k, axis=1), axis=1) for k in range(4)], axis=1)

    def small(values: Array) -> Array:
        return np.arcsinh(values / 0.3)

    by_all, by_set, observer = x[:, 16 + everybody, r], x[:, 16 + without, r], x[:, 1 + without, r]
    return {
        "i_all": i[:, everybody],
        "i_model": small(i[:, nobody]),
        "i_without": small(i[:, without, r]),
        "i_chosen": i[np.arange(len(last)), chosen],
        "m_all": m_all,
        "m_model": small(m_model),
        "m_without": small(m_without),
        "m_chosen": m[np.arange(len(last)), chosen],
        "others_m_all": others(m_all, np.mean),
        "others_m_model": small(others(m_model, np.mean)),
        "most_m_all": others(np.abs(m_all), np.max),
        "most_m_model": others(np.abs(m_model), np.max),
        "most_m_without": others(np.abs(m_without), np.max),
        "size_m_all": np.abs(m_all),
        "size_m_model": np.abs(m_model),
        "size_m_without": np.abs(m_without),
        "x_all": small(by_all),
        "x_observer": small(observer),
        "observer_filter": small(observer - by_all),
        "alone_observer": small(x[:, 1 + alone, r] - observer),
        "without_all": small(by_set - by_all),
        "without_model": small(by_set - x[:, 16 + nobody, r]),
        "j_without": j[:, without],
        "jm_without": jm[:, without],
        "j_alone": j[:, alone],
        "jm_alone": jm[:, alone],
        "jm_least": np.repeat(jm.min(axis=1)[:, np.newaxis], 4, axis=1),
        "believed": believed,
        "others_believed": others(believed, np.mean),
        "left_h": np.repeat(719 / 30 - seen["elapsed_h"][:, np.newaxis], 4, axis=1),
        "outdoor_c": np.repeat(seen["outdoor_c"][:, :1], 4, axis=1),
    }


def test_the_defenders_rows_are_those_of_the_text() -> None:
    adapter, looks = usual_adapter("defender"), []

    def look(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        looks.append(len(looks))
        if looks[-1] % 90 == 80:
            shown, fields = adapter.fields.decode(adapter.observe(seen, state)), adapter.fields
            for name, wanted in expected_rows(seen).items():
                field = fields[[field.name for field in fields].index(name)]
                np.testing.assert_allclose(shown[name], np.clip(wanted, field.low, field.high), atol=2e-6, err_msg=name)

    episode("defender", None, 8, look)
    assert len(looks) == 719


@given(st.lists(st.floats(-10, 10), min_size=2, max_size=6), st.integers(0, 63))
def test_comparisons_with_others_leave_the_own_value_out(values: list[float], code: int) -> None:
    row = np.array([values])
    weights = np.array([[float(code >> place & 1) for place in range(len(values))]])
    for place in range(len(values)):
        counted = [value for k, value in enumerate(values) if k != place and weights[0, k]]
        assert of_others(row, weights)[0, place] == pytest.approx(np.mean(counted) if counted else 0.0, abs=1e-9)


def test_squeezed_columns_keep_the_sign_and_end_at_their_bounds() -> None:
    field = squeezed("bias", "C", 12.0, "")
    values = np.array([-12.0, -0.01, 0.0, 0.01, 12.0])
    narrow = squeeze(values, "C")
    np.testing.assert_allclose(0.3 * np.sinh(narrow), values, atol=1e-12)
    assert (narrow[0], narrow[-1]) == (field.low, field.high)


def test_the_attacker_practises_on_days_with_several_liars_in_preset_learning_only() -> None:
    def weights(**options: Any) -> tuple[float, ...]:
        found: tuple[float, ...] = learning_env("HvacAttack", 2, **options).config.compromised_weights
        return found

    assert weights() == HVAC.training["attacker"].practised["compromised_weights"] != LEARNING.compromised_weights
    assert weights(compromised_weights=(0.0, 1.0)) == (0.0, 1.0)
    assert weights(preset="hard") == LEARNING.compromised_weights


@pytest.mark.parametrize(("fill", "warmer"), [(-2.0, "false"), (2.0, "true")])
def test_two_tests_can_say_what_brink_plays(fill: float, warmer: str) -> None:
    action = len(LEVELS) + FILLS.index(fill)

    def paid(attacker: str) -> Array:
        found: Array = play(attacker, "mtd2", range(6), "learning")["return"]
        return found

    np.testing.assert_allclose(
        paid(f"always?adapter=two_tests&action={action}"), paid(f"brink?warmer={warmer}"), rtol=1e-2
    )


def test_two_tests_hold_levels_as_together_does_and_know_which_readings_have_noise() -> None:
    one, two = adapter_of(spec_of("attacker"), "together"), adapter_of(spec_of("attacker"), "two_tests")

    def look(seen: Seen, state: State, drawn: Array, action: Array, after: State) -> None:
        more = (*state, np.zeros_like(state[0]))
        mine, following = two.act(seen, more, drawn[:, :1])
        theirs, (bias_c, _) = one.act(seen, state, drawn[:, :1])
        np.testing.assert_array_equal(mine, theirs)
        np.testing.assert_array_equal(following[0], bias_c)
        assert not following[2].any()
        exact, then = two.act(seen, more, np.full_like(drawn[:, :1], len(LEVELS)))
        forges = (seen["compromised"] > 0.5) & (seen["active"] > 0.5)[:, np.newaxis]
        np.testing.assert_array_equal(then[2] > 0, forges)
        assert (exact[:, -1] == -1).all()
        assert (then[0] <= 0).all()

    episode("attacker", None, 6, look, num_steps=120, window_steps=60, onset_step=70)


def test_two_tests_refuse_an_attacker_that_keeps_its_noise() -> None:
    with pytest.raises(ConfigurationError, match="two_tests"):
        adapter_of(spec_of("attacker", attack_action="bias"), "two_tests")
