"""Each interface of each id, and CartPole in the same forms; and two measures of the machine.

These are Gymnasium's CartPole, and the simplest vehicle in a compiled loop.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import cycle
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.types import AGENTS, ROLES, FloatArray
from tools.bench.row import Call, Measurement, Values, Yardsticks, calls_per_s, microseconds

PART, ADDED, RESETS = "interfaces", "added", "resets"
PRESETS = ("paper", "learning")
OPPONENT = "none"
CARTPOLE = "CartPole-v1"
NUM_ENVS = (1, 64, 1024)
ACTIONS = 4  # of each environment, drawn beforehand, so that drawing them is not measured
HELD = 16  # decisions that each of them lasts, so that episodes become as different as with somebody who acts
CHUNK = 50  # decisions between two looks at the clock, if an episode has so many


def short(env_id: str) -> str:
    """An id without namespace and version: `HvacAttack`."""
    return env_id.rpartition("/")[2].rpartition("-")[0]


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """CartPole, and every interface of the problems in two presets, against `OPPONENT`."""
    yield from _forms(CARTPOLE, short(CARTPOLE))
    for preset in PRESETS:
        for env_id in (problem.env_id(role) for problem in problems for role in ROLES):
            yield from _forms(env_id, f"{short(env_id)} {preset}", preset=preset, opponent=OPPONENT)
        for problem in problems:
            rate = partial(_rate, partial(parallel, problem, preset), 1)
            yield Measurement(PART, f"{problem.name} {preset} parallel", rate)


def _forms(env_id: str, name: str, **options: Any) -> Iterator[Measurement]:
    yield Measurement(PART, f"{name} single", partial(_rate, partial(single, env_id, **options), 1))
    for envs in NUM_ENVS:
        yield Measurement(PART, f"{name} vector {envs}", partial(_rate, partial(vector, env_id, envs, **options), envs))


def reset_items(problems: list[Problem]) -> Iterator[Measurement]:
    """What a seeded reset of the vector form costs each environment."""
    for preset in PRESETS:
        for problem in problems:
            yield Measurement(RESETS, f"{problem.name} {preset}", partial(_reset, problem, preset))


def _reset(problem: Problem, preset: str, seconds: float, yardsticks: Yardsticks) -> Values:
    options: dict[str, Any] = {"preset": preset, "opponent": OPPONENT, "interface": "native"}
    envs: Any = gymnasium.make_vec(problem.env_id("attacker"), NUM_ENVS[-1], "vector_entry_point", **options)
    return {"reset_us": 1e6 / NUM_ENVS[-1] / calls_per_s(lambda: envs.reset(seed=0), seconds)}


def added_items(problems: list[Problem]) -> Iterator[Measurement]:
    """What interfaces add to the game."""
    for problem in problems:
        for role in ROLES:
            yield Measurement(ADDED, short(problem.env_id(role)), partial(_added, problem.env_id(role)))


def _rate(make: Any, envs: int, seconds: float, yardsticks: Yardsticks) -> Values:
    """Steps of single environments per CPU second; a step of a vector environment counts once for each."""
    steps = envs * calls_per_s(make(), seconds)
    return {"steps_per_s": steps, "step_us": 1e6 / steps, "cartpoles": 1e6 / steps / yardsticks.cartpole_us}


def _moves(space: Any, neutral: Any) -> Iterator[Any]:
    """Random actions; only the neutral one of a role that has illegal ones, which could end an episode."""
    space.seed(0)
    drawn = [space.sample() if neutral is None else neutral for _ in range(ACTIONS)]
    return cycle([action for action in drawn for _ in range(HELD)])


def single(env_id: str, **options: Any) -> Call:
    """A step of `gymnasium.make(id)`, with a reset where an episode has ended."""
    env: Any = gymnasium.make(env_id, **options)
    _, info = env.reset(seed=0)
    actions = _moves(env.action_space, _neutral(env.unwrapped) if "action_mask" in info else None)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return step


def vector(env_id: str, num_envs: int, *, neutral: bool = False, **options: Any) -> Call:
    """A step of the vector form, each environment with an action of its own, or with the `neutral` one if asked for."""
    envs: Any = gymnasium.make_vec(env_id, num_envs, "vector_entry_point", **options)
    _, info = envs.reset(seed=0)
    calm = neutral or "action_mask" in info
    actions = _moves(envs.action_space, np.stack([envs.neutral_action] * num_envs) if calm else None)
    return lambda: envs.step(next(actions))


def parallel(problem: Problem, preset: str) -> Call:
    """A step of the PettingZoo form."""
    env = RolesParallelEnv(problem, preset=preset)
    _, infos = env.reset(seed=0)
    draws = {}
    for role, agent in AGENTS.items():
        neutral = env.game.neutral_action[role] if "action_mask" in infos[agent] else None
        draws[agent] = _moves(env.action_space(agent), neutral)

    def step() -> None:
        env.step({agent: next(draw) for agent, draw in draws.items()})
        if not env.agents:
            env.reset()

    return step


def _neutral(env: Any) -> Any:
    return env.game.neutral_action[env.role]


def _added(env_id: str, seconds: float, yardsticks: Yardsticks) -> Values:
    """Microseconds of a neutral decision of one environment: in the game, and what the interfaces add to that.

    The game alone and the interfaces play the same decisions in turns; the least of many rounds counts for each.
    """
    env: Any = gymnasium.make(env_id, preset="paper", opponent="none").unwrapped
    envs: Any = gymnasium.make_vec(env_id, 1, "vector_entry_point", preset="paper", opponent="none")
    game, role, neutral = env.game, env.role, _neutral(env)
    batch, everyone, interval = neutral[np.newaxis], np.ones(1, np.bool_), game.decision_interval[role]
    count = _decisions(env, neutral, min(CHUNK, game.horizon // interval))

    def physics() -> None:
        game.advance({role: batch}, everyone, interval)
        game.observe(role)

    def rounds() -> tuple[float, float, float]:
        return (
            microseconds(lambda: env.reset(seed=0), physics, count),
            microseconds(lambda: env.reset(seed=0), lambda: env.step(neutral), count),
            microseconds(lambda: envs.reset(seed=0), lambda: envs.step(batch), count),
        )

    found = [rounds()]
    while sum(map(sum, found)) * count < seconds * 1e6 or len(found) < 3:
        found.append(rounds())
    alone, in_single, in_vector = np.min(found, axis=0).tolist()
    return {"game_us": alone, "single_us": in_single - alone, "vector_us": in_vector - alone}


def _decisions(env: Any, neutral: Any, most: int) -> int:
    """How many neutral decisions, `most` at most, the episode of seed 0 lasts."""
    env.reset(seed=0)
    return next((count for count in range(1, most + 1) if env.step(neutral)[2]), most)


VEHICLES = 256  # their positions and speeds stay in the first-level cache
SWEEPS = 200  # 2 s
LINE = 64  # bytes of a line of the cache; arrays that begin elsewhere make the loop half as fast


@kernel
def drive(position: FloatArray, speed: FloatArray, sweeps: int) -> None:
    """Vehicles (n,) that a linear controller steers to 5 m, one step of 0.01 s after the other.

    Three multiplications and four additions a vehicle and step, no branch, no division, no neighbour: what the
    processor's vector units reach in float64 at best, and what no real simulation does.
    """
    for i in range(position.size):
        position[i], speed[i] = 0.0, 1.0
    for _ in range(sweeps):
        for i in range(position.size):
            speed[i] += 0.01 * ((5.0 - position[i]) - 3.0 * speed[i])
            position[i] += 0.01 * speed[i]


@kernel
def divide(numbers: FloatArray, divisors: FloatArray, sweeps: int) -> None:
    """Divide numbers (n,) by others close to 1, again and again."""
    for i in range(numbers.size):
        numbers[i], divisors[i] = 1.0, 1.0 + 1e-9 * i
    for _ in range(sweeps):
        for i in range(numbers.size):
            numbers[i] = numbers[i] / divisors[i]


def measure_yardsticks(seconds: float) -> Yardsticks:
    """Both, with about `seconds` of CPU for each."""
    position, speed = _arrays()
    updates = VEHICLES * SWEEPS * calls_per_s(lambda: drive(position, speed, SWEEPS), seconds)
    divisions = VEHICLES * SWEEPS * calls_per_s(lambda: divide(position, speed, SWEEPS), seconds)
    return Yardsticks(1e6 / calls_per_s(single(CARTPOLE), seconds), updates, divisions)


def _arrays() -> tuple[FloatArray, FloatArray]:
    """Positions and speeds (n,), each at the beginning of a line of the cache and with different places in it."""
    room = np.empty(3 * VEHICLES * 8, np.uint8)
    start, size = -room.ctypes.data % LINE, VEHICLES * 8
    second = start + size + LINE
    return room[start : start + size].view(np.float64), room[second : second + size].view(np.float64)
