"""The attackers as policies, through the environments' own observations and actions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_baselines.fdi import replay_policy
from cps_baselines.fdi.action_form import ActionForm
from cps_baselines.fdi.bnb_policy import BranchAndBound
from cps_baselines.fdi.branch_and_bound import find_injections, make_search
from cps_baselines.fdi.random_injection import RandomInjection
from cps_baselines.fdi.replay_policy import Replay
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.optima import Record, known
from cps_envs.fdi.problem import FDI
from cps_paper.fdi.interpretations import FIGURE
from tests.fdi.episodes import play, spec_of, task_settings, watched

PAPER = FDI.config("paper", {})
FEASIBLE = [record for record in known(PAPER).values() if record.feasible]
SINGLE = [record for record in FEASIBLE if not set(record.task.sensors.range) & set(record.task.sensors.range_rate)]
TASKS = ("x1>1", "x3>4", "v4>4", "x1,2>1", "xv4>4", "x1+v3>2", "xv1,4>4")


def replayed(record: Record, **overrides: Any) -> dict[str, Array]:
    return play("oracle", **task_settings(record.task), **overrides)


@pytest.mark.parametrize("record", FEASIBLE, ids=lambda record: str(record.task))
def test_replay_attains_the_shipped_value(record: Record) -> None:
    outcome = replayed(record)
    assert outcome["return"][0] == pytest.approx(record.value_mps, abs=1e-4)
    assert outcome["return"][0] <= record.bound_mps + 1e-5
    assert outcome["bound_valid"][0] == 1


def test_replay_knows_the_task_that_was_drawn() -> None:
    outcome = play("oracle", preset="easy", seeds=range(200))
    assert np.allclose(outcome["return"], outcome["oracle_value_mps"], atol=1e-4)


def test_replay_waits_as_told_and_starts_at_random() -> None:
    later = play("oracle?start=5", horizon=25, **task_settings("x4>4"))
    assert later["return"][0] == pytest.approx(known(PAPER)[FDI.config("paper", {}).fixed_task].value_mps, abs=1e-4)
    assert later["time_s"][0] == pytest.approx(25 * 0.2)
    times = play("oracle?start=random", horizon=60, seeds=range(20))["time_s"]
    assert len(set(times.tolist())) > 5
    assert times.min() >= 4.0 - 1e-9


def test_replay_finds_small_optima_itself_and_names_the_remedy_for_large_ones() -> None:
    assert play("oracle", horizon=15)["collided_target"][0] == 1
    with pytest.raises(ConfigurationError, match="cps-envs certify"):
        Replay(spec_of("attacker", **FIGURE))
    with pytest.raises(ConfigurationError, match="another task"):
        Replay(spec_of("attacker", **task_settings("x1>4")))
    with pytest.raises(ConfigurationError, match="start"):
        Replay(spec_of("attacker"), start=-1)


def test_replay_needs_no_solver_for_shipped_optima(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_policy, "_solved", None)
    assert play("oracle")["collided_target"][0] == 1


@given(
    record=st.sampled_from(FEASIBLE),
    seed=st.integers(0, 10_000),
    stickiness=st.sampled_from([0.0, 0.5, 0.9]),
    extremes=st.booleans(),
)
@settings(max_examples=60)
def test_no_random_policy_exceeds_the_bound(record: Any, seed: int, stickiness: float, extremes: bool) -> None:
    attacker = f"random?stickiness={stickiness}&extremes={str(extremes).lower()}"
    outcome = play(attacker, seeds=range(seed, seed + 40), **task_settings(record.task))
    assert outcome["return"].max() <= record.bound_mps + 1e-5


@pytest.mark.parametrize("attacker", ["random", "bang_bang", "bang_bang?stickiness=0.95"])
def test_nothing_exceeds_the_bounds_over_all_tasks(attacker: str) -> None:
    outcome = play(attacker, preset="easy", seeds=range(3000))
    assert np.all(outcome["return"] <= outcome["oracle_bound_mps"] + 1e-5)
    assert outcome["return"].max() > 1


@pytest.mark.parametrize("task", TASKS)
def test_random_injections_are_legal(task: str) -> None:
    dead_ends: list[Array] = []

    def look(game: FdiGame) -> None:
        legal, active = game.state.legal, ~game.terminated
        dead_ends.append(np.any(legal[..., 0] > legal[..., 1], axis=1) & active)
        law = game.state.error @ game.config.model.feedback.T
        free = np.setdiff1d(np.arange(4), game.tasks[0].sensors.vehicles - np.ones(1, int))
        dead_ends[-1] |= np.any(np.abs(law[:, free]) > 5, axis=1) & active

    policy = RandomInjection(spec_of("attacker", **task_settings(task)), stickiness=0.5, extremes=True)
    outcome = play(policy, seeds=range(200), on_step=look, **task_settings(task))
    illegal = outcome["illegal"] > 0
    assert np.all(np.any(dead_ends, axis=0)[illegal])


def test_random_injections_obey_their_bounds() -> None:
    spec = spec_of("attacker")
    rest = np.zeros((50, spec.fields.size), np.float32)
    small = RandomInjection(spec, largest=2)
    levels = np.concatenate([small.predict(rest)[0] for _ in range(3)]) - 100
    assert np.abs(levels).max() == 2
    extremes = RandomInjection(spec, extremes=True).predict(rest)[0] - 100
    assert set(extremes.ravel().tolist()) == {-10, 10}  # |u| <= 5 m/s2, k_p = 1, resolution 0.5 m
    with pytest.raises(ConfigurationError, match="stickiness"):
        RandomInjection(spec, stickiness=1.5)


def test_random_injections_repeat_by_seed() -> None:
    first, again, other = (play("random", seeds=[seed])["return"] for seed in (1, 1, 2))
    assert first == again
    draws = [RandomInjection(spec_of("attacker")).begin([np.random.default_rng(seed)], [{}])[0][0] for seed in (1, 2)]
    assert not np.array_equal(*draws)
    assert other.shape == (1,)


@pytest.mark.parametrize(("kind", "steps_ahead"), [("x", 0), ("v", 0), ("xv", 0), ("x", 2), ("xv", 1)])
def test_bnb_plays_what_the_planner_finds(kind: str, steps_ahead: int) -> None:
    overrides = {**FIGURE, "horizon": 120, "attacked": f"{kind}10"}
    config = FDI.config("paper", overrides)
    search = make_search(config, 10, kind, steps_ahead, width=3 if steps_ahead else 0)
    model, error, expected = config.model, np.zeros(20), []
    while len(expected) < config.horizon:
        for levels in find_injections(search, error[np.newaxis]).levels[0]:
            injection = np.zeros(20)
            injection[search.readings] = levels * np.where(search.readings < 10, 0.5, 0.25)
            error = model.transition @ error + model.injection @ injection
            expected.append(injection)
    policy = BranchAndBound(spec_of("attacker", **overrides), steps_ahead=steps_ahead, width=3 if steps_ahead else 0)
    seen = watched(lambda game: game.episode(0).injection.copy(), policy, **overrides)
    assert np.array_equal(seen[1:], expected[: len(seen) - 1])
    assert len(seen) > 60


# Spec 6.4, first row: +-1 step, +-0.01 m/s.
@pytest.mark.parametrize(("attacked", "time_s", "speed_mps"), [("x10", 30.45, 3.89), ("xv10", 12.45, 5.05)])
def test_bnb_through_the_environment_gives_figure_3_2(attacked: str, time_s: float, speed_mps: float) -> None:
    outcome = play("bnb", **{**FIGURE, "attacked": attacked})
    assert outcome["time_s"][0] == pytest.approx(time_s, abs=0.051)
    assert outcome["return"][0] == pytest.approx(speed_mps, abs=0.01)


def test_bnb_counts_states_without_injection() -> None:
    weak = {**FIGURE, "max_range_injection_m": 0.5}
    policy = BranchAndBound(spec_of("attacker", **weak))
    play(policy, **weak)
    assert policy.infeasible_calls > 0
    with pytest.raises(ConfigurationError, match="steps_ahead"):
        BranchAndBound(spec_of("attacker"), steps_ahead=-1)


def test_bnb_attacks_several_vehicles_and_drawn_tasks() -> None:
    assert play("bnb", attacked="xv1,4", target=4)["injected_share"][0] > 0.3
    assert play("bnb", tasks="x1>1 xv4>4", seeds=range(20))["injected_share"].min() > 0


@pytest.mark.parametrize("task", ["x4>4", "x1>1", "v4>4", "x2>2", "v1,2>1"])
def test_lp_greedy_comes_near_the_optimum(task: str) -> None:
    outcome = play("lp_greedy", **task_settings(task))
    assert 0.9 * outcome["oracle_value_mps"][0] < outcome["return"][0] <= outcome["oracle_bound_mps"][0] + 1e-5


def test_lp_greedy_never_exceeds_the_bound_and_refuses_nonsense() -> None:
    outcome = play("lp_greedy", preset="easy", seeds=[0])
    assert np.all(outcome["return"] <= outcome["oracle_bound_mps"] + 1e-5)
    with pytest.raises(ConfigurationError, match="max_steps"):
        play("lp_greedy?max_steps=0")


@pytest.mark.parametrize("task", TASKS)
def test_actions_inject_the_levels_that_they_stand_for(task: str) -> None:
    config = FDI.config("paper", task_settings(task))
    game, translator, generator = FDI.game(config, 1), ActionForm(config), np.random.default_rng(0)
    everything = np.ones((1, len(translator.sensors)), np.bool_)
    game.reset(np.ones(1, np.bool_), [generator])
    while not game.terminated[0] and game.elapsed[0] < game.horizon:
        error = game.episode(0).error[np.newaxis].copy()
        wishes = generator.integers(-translator.bounds, translator.bounds + 1)[np.newaxis]
        actions, levels = translator.to_actions(error, everything, wishes)
        game.advance({"attacker": actions}, np.ones(1, np.bool_), 1)
        injected = game.episode(0).injection[translator.sensors]
        assert np.allclose(injected, levels[0] * np.where(translator.sensors < 4, 0.5, 0.25))
