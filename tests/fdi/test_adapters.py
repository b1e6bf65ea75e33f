"""What learners attack through: lies that move like a vehicle, or that the filter half expects."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.adapter import Adapter
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array
from cps_envs.fdi.adapters.expected import LEVELS, Expected
from cps_envs.fdi.adapters.motion import LEVELS_MPS2, Motion
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from tests.fdi.episodes import QUIET, advance, place, play, spec_of, started

FORMS = {"motion": Motion, "expected": Expected}
ATTACKED: dict[str, Any] = {"attack_share": 1.0, "onset_s": 0.0}
EACH_FORM = pytest.mark.parametrize("form", FORMS)


def seen_by(game: FdiGame) -> Seen:
    return Seen(game.fields["attacker"], game.observe("attacker"), masks=game.action_mask("attacker"))


def told(game: FdiGame, adapter: Adapter, choose: Any, steps: int) -> Array:
    """Injections (steps, B, R), m and m/s, under the agents' actions `choose(step)`."""
    state, found = adapter.begin(game.num_envs), []
    everyone = np.ones(game.num_envs, np.bool_)
    for step in range(steps):
        actions = np.broadcast_to(choose(step), (game.num_envs, 1, *(adapter.action_space.shape or ())))
        native, state = adapter.act(seen_by(game), state, actions)
        assert all(game.action_space["attacker"].contains(row) for row in native)
        game.advance({"attacker": native}, everyone & ~game.terminated, 1)
        found.append(game.state.injection.copy())
    return np.array(found)


@given(st.lists(st.integers(0, len(LEVELS_MPS2) - 1), min_size=1, max_size=15))
@settings(max_examples=20)
def test_a_lie_in_motion_is_what_its_accelerations_integrate_to(choices: list[int]) -> None:
    game = started(2, tasks="xv3+rv4>3", paid_pair="target", **ATTACKED)
    lies = told(game, Motion(game.spec("attacker")), lambda step: choices[step], len(choices))
    dt_s, speed, lie = 0.1, 0.0, 0.0
    for step, choice in enumerate(choices):
        lie += dt_s * speed + dt_s**2 / 2 * LEVELS_MPS2[choice]
        speed += dt_s * LEVELS_MPS2[choice]
        assert np.all(np.abs(lies[step, :, place("x3")] - lie) <= 0.25 + 1e-9)
        assert np.all(np.abs(lies[step, :, [place("v3"), place("rv4")]] - speed) <= 0.125 + 1e-9)
        assert np.count_nonzero(np.delete(lies[step], [place(name) for name in ("x3", "v3", "rv4")], axis=1)) == 0


def test_an_expected_lie_shows_the_filter_the_asked_innovation() -> None:
    exact = {**QUIET, "range_resolution_m": 0.01, "rate_resolution_mps": 0.01, "range_noise_m": 0.25}
    game = started(4, tasks="xv2>2", paid_pair="target", **{**exact, "rate_noise_mps": 0.1, "quantised": False})
    game.state.noise[:] = 0.0
    ranges, rates = LEVELS.index(1.0), LEVELS.index(-0.5)
    told(game, Expected(game.spec("attacker")), lambda step: (ranges, rates), 3)
    decoded = game.fields["defender"].decode(game.observe("defender"))
    shown = decoded["range_innovation"][:, 1] / decoded["range_deviation"][:, 1]
    # the lie aims at the prediction of the step that begins, which its own effect on the filter moves
    assert np.all(shown > 0.3)
    assert np.all(decoded["rate_innovation"][:, 1] < 0)


def test_rounding_is_carried_over() -> None:
    game = started(64, tasks="x4>4", paid_pair="target", **{**ATTACKED, **QUIET})
    adapter = Expected(game.spec("attacker"))
    state = adapter.begin(64)
    seen = seen_by(game)
    native, (left,) = adapter.act(seen, state, np.full((64, 1, 2), LEVELS.index(0.5)))
    level = native[:, place("x4")] - adapter.bounds[place("x4")]
    wanted = 0.5 * seen["range_deviation"][:, 3] + seen["predicted_gap_error"][:, 3] - seen["gap_error"][:, 3]
    np.testing.assert_allclose(level * 0.5 + left[:, place("x4")], wanted, atol=1e-9)
    assert np.all(np.abs(left) <= 0.25)


@EACH_FORM
def test_nothing_is_told_before_the_onset_and_no_more_than_is_legal(form: str) -> None:
    game = started(8, onset_s=1.0, attack_share=1.0)
    adapter = FORMS[form](game.spec("attacker"))
    most = np.full(adapter.action_space.shape or (), len(LEVELS_MPS2) - 1)
    lies = told(game, adapter, lambda step: most, 60)
    assert not lies[:9].any()
    assert lies[20].any(axis=1).all()
    assert np.abs(lies[..., :7]).max() <= game.config.max_range_injection_m
    assert np.abs(lies[..., 7:]).max() <= game.config.max_rate_injection_mps


@EACH_FORM
def test_an_attacker_is_active_from_shortly_before_its_lies_work(form: str) -> None:
    game = started(2, onset_s=2.0, attack_share=1.0)
    adapter, found = FORMS[form](game.spec("attacker")), []
    for _ in range(20):
        found.append(adapter.active(seen_by(game), ())[:, 0].tolist())
        advance(game)
    assert found == [[False] * 2] * 14 + [[True] * 2] * 6  # the first lie changes readings at step 20


@EACH_FORM
@pytest.mark.parametrize("preset", ["paper", "clip"])
def test_without_a_filter_there_is_nobody_to_lie_to(form: str, preset: str) -> None:
    with pytest.raises(ConfigurationError, match='estimator = "kalman"'):
        FORMS[form](spec_of("attacker", preset=preset))
    with pytest.raises(ConfigurationError, match="attack_action"):
        FORMS[form](spec_of("attacker", preset="learning", attack_action="share"))


@EACH_FORM
def test_a_fixed_task_has_slots_for_its_sensors_only(form: str) -> None:
    game = started(2, tasks="", attacked="v2+rv3", target=2, **ATTACKED)
    adapter = FORMS[form](game.spec("attacker"))
    state = adapter.begin(2)
    native, state = adapter.act(seen_by(game), state, np.full((2, 1, *(adapter.action_space.shape or ())), 8))
    assert native.shape == (2, 2)
    shown = adapter.fields.decode(adapter.observe(seen_by(game), state)[:, 0])
    assert shown["attacked"].tolist() == [[0, 1, 1]] * 2
    assert shown["gap"].tolist() == [[0, 1, 0, 0]] * 2


@EACH_FORM
def test_what_is_seen_is_centred_on_the_attacked_gap(form: str) -> None:
    game = started(16, attack_share=1.0, onset_s=0.0)
    adapter = FORMS[form](game.spec("attacker"))
    told(game, adapter, lambda step: np.full(adapter.action_space.shape or (), 4), 10)
    state, n = adapter.begin(16), 4
    shown = adapter.fields.decode(adapter.observe(seen_by(game), state)[:, 0])
    for b in range(16):
        gap = int(game.state.task[b] >= 0 and np.argmax(shown["gap"][b]))
        first = int(np.flatnonzero(game.truth(b)["attacked"])[0]) % 7
        assert gap == (first if first < n else first - n)
        error, speed = game.state.error[b, :n], game.state.error[b, n:]
        assert 0.1 * np.sinh(shown["gap_error"][b, 0]) == pytest.approx(error[gap], abs=1e-4)
        assert 0.05 * np.sinh(shown["relative_speed"][b, 0]) == pytest.approx(speed[gap], abs=1e-4)
        ahead = error[gap + 1] if gap < n - 1 else 0.0
        behind = error[gap - 1] if gap > 0 else 0.0
        assert 0.1 * np.sinh(shown["gap_error"][b, 1:]) == pytest.approx([ahead, behind], abs=1e-4)


@EACH_FORM
def test_most_of_what_is_seen_varies_while_nobody_lies(form: str) -> None:
    game = started(64)
    adapter = FORMS[form](game.spec("attacker"))
    state, rows = adapter.begin(64), []
    cusum = FDI.policy("cusum", game, "defender")
    memory: Any = cusum.begin([np.random.default_rng(b) for b in range(64)], [{}] * 64)  # type: ignore[attr-defined]
    for _ in range(game.horizon):
        rows.append(adapter.observe(seen_by(game), state)[:, 0])
        defence, memory = cusum.predict(game.observe("defender"), memory)
        game.advance({"defender": defence}, ~game.terminated, 1)
    spread = np.concatenate(rows).std(axis=0)
    assert np.mean(spread >= 0.2) >= 0.9


def test_the_state_is_not_changed_in_place_and_rows_do_not_mix() -> None:
    game = started(3, attack_share=1.0, onset_s=0.0)
    for form in FORMS.values():
        adapter = form(game.spec("attacker"))
        state = adapter.begin(3)
        kept = tuple(array.copy() for array in state)
        actions = np.array([[8], [4], [0]]).reshape(3, 1, *([1] * len(adapter.action_space.shape or ())))
        actions = np.broadcast_to(actions, (3, 1, *(adapter.action_space.shape or ())))
        seen = seen_by(game)
        native, after = adapter.act(seen, state, actions)
        for old, now in zip(kept, state, strict=True):
            np.testing.assert_array_equal(old, now)
        for b in range(3):
            alone, state_alone = adapter.act(seen.part([b]), adapter.begin(1), actions[b : b + 1])
            np.testing.assert_array_equal(alone[0], native[b])
            np.testing.assert_array_equal(state_alone[0][0], after[0][b])


class Held(AnalyticPolicy):
    """The same choice of a form for ever."""

    def __init__(self, adapter: Adapter, choice: int) -> None:
        super().__init__(adapter.spec)
        self.adapter, self.action = adapter, np.full((1, *(adapter.action_space.shape or ())), choice)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        return self.adapter.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        return self.adapter.act(seen, state, np.repeat(self.action[np.newaxis], len(seen), axis=0))


@pytest.mark.parametrize(("form", "level", "least"), [("motion", 1.0, 1.1), ("expected", 2.5, 1.4)])
def test_constants_of_a_good_form_are_strong_attacks(form: str, level: float, least: float) -> None:
    adapter = FORMS[form](spec_of("attacker", preset="learning"))
    choices = {"motion": LEVELS_MPS2, "expected": LEVELS}[form]
    pay = {
        chosen: play(Held(adapter, choices.index(chosen)), "cusum", range(120), "learning", attack_share=1.0)["return"]
        for chosen in (0.0, level)
    }
    assert pay[0.0].mean() < 0.3
    assert pay[level].mean() > least


def test_the_registered_mimic_plays_constant_motion() -> None:
    found = play("mimic?acceleration_mps2=0.5", "cusum", range(60), "learning", attack_share=1.0)
    quiet = play("mimic?acceleration_mps2=0", "cusum", range(60), "learning", attack_share=1.0)
    assert quiet["return"].mean() < 0.1
    assert 0.9 < found["return"].mean() < 1.8


def test_a_mimic_may_have_an_acceleration_for_each_task() -> None:
    tasks = spec_of("attacker", preset="learning").config.listed_tasks
    same = play(f"mimic?by_task={[0.5] * len(tasks)}".replace(" ", ""), "bank", range(40), "learning")
    np.testing.assert_array_equal(same["return"], play("mimic", "bank", range(40), "learning")["return"])
    own = play("mimic?by_task=[1.0,0.7,0.85,2.0,3.0,2.0,0.6,0.3]", "bank", range(200), "learning")
    assert own["return"].mean() > 1.1 * play("mimic", "bank", range(200), "learning")["return"].mean()
    with pytest.raises(ConfigurationError, match="by_task has 2 accelerations for 8 tasks"):
        play("mimic?by_task=[1.0,2.0]", "bank", range(1), "learning")
