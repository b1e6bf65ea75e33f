"""Games and episodes of false data injection for the tests, and the filter of its duel once more, in matrices."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array, FloatArray
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from tests import episodes

play = partial(episodes.play, FDI)
spec_of = partial(episodes.spec_of, FDI)
watched = partial(episodes.watched, FDI)
QUIET: dict[str, Any] = {  # exact sensors, nothing drawn
    "range_noise_m": 0.0,
    "rate_noise_mps": 0.0,
    "quantised": False,
    "disturbance_mps2": 0.0,
    "disturbance_hold_s": 0.0,
    "own_phases": False,
    "gain_spread": 0.0,
    "gap_spread_m": 0.0,
    "speed_spread_mps": 0.0,
    "attack_share": 1.0,
    "onset_s": 0.0,
}


def task_settings(task: Any) -> dict[str, Any]:
    """The overrides that fix a task, "x4>4" or a `Task`."""
    attacked, target = str(task).split(">")
    return {"attacked": attacked, "target": int(target)}


def started(num_envs: int = 1, seed: int = 0, **overrides: Any) -> FdiGame:
    """A game in preset `learning`, reset."""
    game = FdiGame(FDI.config("learning", overrides), num_envs)
    game.reset(np.ones(num_envs, np.bool_), [np.random.default_rng(seed + b) for b in range(num_envs)])
    return game


def advance(game: FdiGame, attack: Array | None = None, defense: Array | None = None) -> None:
    """One step under the same actions in all environments; neutral ones where they are left out."""
    actions = {}
    for role, action in (("attacker", attack), ("defender", defense)):
        if action is not None:
            actions[role] = np.repeat(np.asarray(action)[np.newaxis], game.num_envs, axis=0)
    game.advance(actions, np.ones(game.num_envs, np.bool_), 1)


def levels(game: FdiGame, wanted: dict[str, int]) -> Array:
    """An attacker's action that injects levels by sensor, such as {"x1": 3, "rv2": -1}."""
    action = game.neutral_action["attacker"].copy()
    for sensor, level in wanted.items():
        action[place(sensor)] += level
    return action


def place(sensor: str, num_vehicles: int = 4) -> int:
    """Where a sensor's reading stands: front ranges, rear ranges of 2..n, front rates, rear rates."""
    rear, kind, vehicle = sensor.startswith("r"), sensor.lstrip("r")[0], int(sensor[-1])
    return (kind == "v") * (2 * num_vehicles - 1) + (num_vehicles + vehicle - 2 if rear else vehicle - 1)


class Filter:
    """A Kalman filter as in textbooks: all trusted readings at once, by the inverse of their joint covariance."""

    def __init__(self, game: FdiGame) -> None:
        c, n = game.config, game.config.num_vehicles
        self.n, dt = n, c.dt_s
        self.a = np.eye(2 * n) + dt * np.eye(2 * n, k=n)
        accelerate = np.vstack([dt**2 / 2 * np.eye(n), dt * np.eye(n)])
        self.b = accelerate @ (np.eye(n, k=1) - np.eye(n))
        order = [*range(n), *range(n - 1)]
        self.h = np.eye(2 * n)[[*order, *(n + i for i in order)]]
        steps = np.repeat([c.range_resolution_m, c.rate_resolution_mps], 2 * n - 1)
        noise = np.concatenate([np.full(2 * n - 1, 1.0) * each for each in (c.range_noise_m, c.rate_noise_mps)])
        self.r = np.diag(np.maximum(noise**2 + c.quantised * steps**2 / 12, 1e-6))
        strongest = np.max(c.disturbance_mps2)
        lasting = max(round(c.disturbance_hold_s / dt), 1)
        self.q = lasting * strongest**2 * self.b @ self.b.T
        self.x: FloatArray = np.zeros(2 * n)
        self.p = np.diag(np.repeat([c.gap_spread_m**2 / 3, c.speed_spread_mps**2 / 3], n))

    def take(self, reading: FloatArray, trusted: Array) -> None:
        """The estimate of now from the trusted readings."""
        h, r = self.h[trusted], self.r[np.ix_(trusted, trusted)]
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        self.x = self.x + gain @ (reading[trusted] - h @ self.x)
        self.p = (np.eye(2 * self.n) - gain @ h) @ self.p

    def go_on(self, command: FloatArray) -> None:
        """The prediction of the next step."""
        self.x = self.a @ self.x + self.b @ command
        self.p = self.a @ self.p @ self.a.T + self.q
