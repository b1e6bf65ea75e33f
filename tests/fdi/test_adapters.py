"""What learners attack through: lies that move like a vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.types import Array
from cps_envs.fdi.adapters.motion import LEVELS_MPS2, Motion
from cps_envs.fdi.game import FdiGame
from tests.episodes import seen_by
from tests.fdi.episodes import advance, place, play, spec_of, started

ATTACKED: dict[str, Any] = {"attack_share": 1.0, "onset_s": 0.0}


def told(game: FdiGame, adapter: Adapter, choose: Any, steps: int) -> Array:
    """Injections (steps, B, R), m and m/s, under the agents' actions `choose(step)`."""
    state, found = adapter.begin(game.num_envs), []
    everyone = np.ones(game.num_envs, np.bool_)
    for step in range(steps):
        actions = np.full((game.num_envs, 1), choose(step))
        native, state = adapter.act(seen_by(game, adapter), state, actions)
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


def test_nothing_is_told_before_the_onset_and_no_more_than_is_legal() -> None:
    game = started(8, onset_s=1.0, attack_share=1.0)
    adapter = Motion(game.spec("attacker"))
    lies = told(game, adapter, lambda step: len(LEVELS_MPS2) - 1, 60)
    assert not lies[:9].any()
    assert lies[20].any(axis=1).all()
    assert np.abs(lies[..., :7]).max() <= game.config.max_range_injection_m
    assert np.abs(lies[..., 7:]).max() <= game.config.max_rate_injection_mps


def test_an_attacker_is_active_from_shortly_before_its_lies_work() -> None:
    game = started(2, onset_s=2.0, attack_share=1.0)
    adapter, found = Motion(game.spec("attacker")), []
    for _ in range(20):
        found.append(adapter.active(seen_by(game, adapter), ())[:, 0].tolist())
        advance(game)
    assert found == [[False] * 2] * 14 + [[True] * 2] * 6  # the first lie changes readings at step 20


@pytest.mark.parametrize("preset", ["paper", "defense"])
def test_without_a_filter_there_is_nobody_to_lie_to(preset: str) -> None:
    with pytest.raises(ConfigurationError, match='estimator = "kalman"'):
        Motion(spec_of("attacker", preset=preset))


def test_a_fixed_task_has_slots_for_its_sensors_only() -> None:
    game = started(2, tasks="", attacked="v2+rv3", target=2, **ATTACKED)
    adapter = Motion(game.spec("attacker"))
    state = adapter.begin(2)
    native, state = adapter.act(seen_by(game, adapter), state, np.full((2, 1), 8))
    assert native.shape == (2, 2)
    shown = adapter.fields.decode(adapter.observe(seen_by(game, adapter), state)[:, 0])
    assert shown["attacked"].tolist() == [[0, 1, 1]] * 2
    assert shown["gap"].tolist() == [[0, 1, 0, 0]] * 2


def test_what_is_seen_is_centred_on_the_attacked_gap() -> None:
    game = started(16, attack_share=1.0, onset_s=0.0)
    adapter = Motion(game.spec("attacker"))
    told(game, adapter, lambda step: 4, 10)
    state, n = adapter.begin(16), 4
    shown = adapter.fields.decode(adapter.observe(seen_by(game, adapter), state)[:, 0])
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


def test_a_constant_acceleration_is_a_strong_attack_which_the_mimic_is_by_name() -> None:
    def paid(attacker: str) -> Array:
        return play(attacker, "cusum", range(120), "learning", attack_share=1.0)["return"]

    still, moving = (paid(f"always?adapter=motion&action={LEVELS_MPS2.index(chosen)}") for chosen in (0.0, 1.0))
    assert still.mean() < 0.3
    assert moving.mean() > 1.1
    np.testing.assert_array_equal(paid("mimic?acceleration_mps2=1"), moving)


def test_a_mimic_may_have_an_acceleration_for_each_task() -> None:
    tasks = spec_of("attacker", preset="learning").config.listed_tasks
    same = play(f"mimic?by_task={[0.5] * len(tasks)}".replace(" ", ""), "bank", range(40), "learning")
    np.testing.assert_array_equal(same["return"], play("mimic", "bank", range(40), "learning")["return"])
    own = play("mimic?by_task=[1.0,0.7,0.85,2.0,3.0,2.0,0.6,0.3]", "bank", range(200), "learning")
    assert own["return"].mean() > 1.1 * play("mimic", "bank", range(200), "learning")["return"].mean()
    with pytest.raises(ConfigurationError, match="by_task has 2 accelerations for 8 tasks"):
        play("mimic?by_task=[1.0,2.0]", "bank", range(1), "learning")
