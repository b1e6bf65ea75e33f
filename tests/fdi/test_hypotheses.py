"""The defender that weighs hypotheses: its filters against textbooks, whom it finds, and that it is quiet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.family import Members, find_family
from cps_baselines.fdi.disturbance_filter import DRIFT_MPS2, hypothesis_filters
from cps_baselines.fdi.hypotheses import Hypotheses
from cps_envs.core.play import play_episodes
from cps_envs.fdi.problem import FDI
from tests.fdi.duel import Filter, place, started
from tests.fdi.episodes import play, spec_of

SPEC = spec_of("defender", preset="learning")
FAMILY = find_family("fdi-hypotheses")
LOOSE = 1e6  # deviations: nothing is an outlier


class JointFilter:
    """The filter with disturbances as in textbooks: all readings at once, by the inverse of their covariance."""

    def __init__(self, heard: np.ndarray, drift_mps2: float = 0.0) -> None:
        plain = Filter(started())
        n = plain.n
        self.heard, self.r, self.command = heard, plain.r, plain.b
        self.h = np.hstack([plain.h, np.zeros((len(plain.h), n + 1))])
        self.a = np.eye(3 * n + 1)
        self.a[: 2 * n] = np.hstack([plain.a, plain.b, plain.b.sum(axis=1, keepdims=True)])
        self.x = np.zeros(3 * n + 1)
        self.fresh = (0.3**2 + 0.3 * 0.5 + 0.5**2) / 3  # mean square of deviations from 0.3 to 0.5 m/s2
        self.p = np.diag([*np.diag(plain.p), *np.full(n, self.fresh), drift_mps2**2])

    def take(self, reading: np.ndarray) -> None:
        """The estimate of now."""
        h, r = self.h[self.heard], self.r[np.ix_(self.heard, self.heard)]
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        self.x = self.x + gain @ (reading[self.heard] - h @ self.x)
        self.p = self.p - gain @ h @ self.p

    def go_on(self, command: np.ndarray, step: int) -> None:
        """The prediction of this step; disturbances last 10 steps."""
        n = len(command)
        self.x, self.p = self.a @ self.x, self.a @ self.p @ self.a.T
        self.x[: 2 * n] += self.command @ command
        if step % 10 == 0:
            own = slice(2 * n, 3 * n)
            self.x[own], self.p[own], self.p[:, own] = 0.0, 0.0, 0.0
            self.p[own, own] = self.fresh * np.eye(n)


@pytest.mark.parametrize("hypothesis", [0, 1, 20, -1])
def test_every_filter_is_that_of_textbooks(hypothesis: Any) -> None:
    known, defender = hypothesis_filters(SPEC.config), Hypotheses(SPEC, outlier=LOOSE)
    joint = JointFilter(known.heard[hypothesis], DRIFT_MPS2 if hypothesis == -1 else 0.0)
    state = defender.begin([np.random.default_rng(0)], [{}])

    def look(game: Any) -> None:
        nonlocal state
        if game.elapsed[0] < 25:
            if game.elapsed[0] > 0:
                joint.go_on(game.state.command[0], int(game.elapsed[0]))
            joint.take(game.state.reading[0])
            _, state = defender.predict(game.observe("defender"), state)
            np.testing.assert_allclose(state[0][0, hypothesis], joint.x, atol=1e-4)

    play_episodes(FDI, SPEC.config, {"attacker": "tracker", "defender": "bank"}, [3], on_step=look)


def test_a_wrong_belief_costs_the_first_filter_nothing() -> None:
    surprise = hypothesis_filters(SPEC.config).surprise
    assert np.all(surprise[:, 0] == 0)
    assert surprise[1:].min() > -1e-9  # who hears less expects wider innovations


@pytest.mark.parametrize("task", FDI.config("learning", {}).tasks.split())
def test_loud_lies_are_found_and_do_hardly_any_harm(task: Any) -> None:
    settings = {"preset": "learning", "tasks": task, "attack_share": 1.0, "seeds": range(20)}
    outcome = play("swing", Hypotheses(SPEC), **settings)
    assert outcome["detected"].min() == 1
    most = 0.2 if task == "xv4>4" else 0.0  # the lead drives blindly then, and may collide slowly
    assert outcome["impact_speed_mps"].mean() <= most


def test_quiet_lies_do_less_harm_than_against_the_bank() -> None:
    settings = {"preset": "learning", "attack_share": 1.0, "seeds": range(60)}
    found, bank = (play("tracker", defender, **settings)["impact_speed_mps"] for defender in (Hypotheses(SPEC), "bank"))
    assert found.mean() < 0.5 * bank.mean()


def test_it_is_quiet_where_nobody_attacks() -> None:
    outcome = play("none", Hypotheses(SPEC), preset="learning", seeds=range(200))
    assert outcome["false_alarm"].mean() < 0.1
    assert outcome["collided_pairs"].max() == 0


def test_a_vehicle_brakes_that_nobody_can_check() -> None:
    row = np.zeros((1, SPEC.fields.size))
    row[0, SPEC.fields.slices["steps_left"]] = 100
    for sensor in ("x4", "v4"):
        name = "range_error" if sensor == "x4" else "range_rate"
        row[0, SPEC.fields.slices[name].start + place(sensor) % 7] = 9.0
    defender = Hypotheses(SPEC, threshold=1.0, per_sensor=0.1, correction=0.0, caution=1.0)
    actions, _ = defender.predict(SPEC.fields.encode(row), defender.begin([np.random.default_rng(0)], [{}]))
    assert actions[0, [place("x4"), place("v4")]].tolist() == [0, 0]
    assert actions[0, 14:].tolist() == [4, 4, 4, 2]  # 1 m/s2 in steps of 0.5


def test_each_episode_is_played_by_its_own_numbers() -> None:
    points = np.random.default_rng(1).normal(size=(6, len(FAMILY.numbers)))
    values = FAMILY.values(points)
    together = play("tracker", Members(SPEC, FAMILY, values), preset="learning", seeds=range(6))
    for b in range(6):
        alone = play("tracker", FAMILY.build(SPEC, values[b : b + 1]), preset="learning", seeds=[b])
        assert alone["return"][0] == together["return"][b]
