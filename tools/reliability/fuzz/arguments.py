"""Arguments of the environments, seeds, options of a reset, and calls in the wrong order."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.actions import seat
from tools.reliability.fuzz.configurations import QUICKER
from tools.reliability.fuzz.judging import Tally, limited, wrong_numbers
from tools.reliability.fuzz.values import Generator, in_words, legal_batch, odd_value, pick, shown

INPUTS = 200  # of a chunk
NAMES = (
    "num_envs",
    "autoreset_mode",
    "preset",
    "opponent",
    "render_mode",
    "max_episode_steps",
    "frame_skip",
    "num_threads",
    "unknown_argument",
)
MOST_ENVS, MOST_THREADS = 64, 4  # of those that are accepted: larger ones only cost memory
CALLS = ("step", "reset", "masked reset", "seeded reset", "render", "close", "step")


def arguments(chunk: Chunk, tally: Tally) -> None:
    """An environment with some odd arguments; what is accepted is called in any order."""
    problem, role, _ = seat(chunk.number)
    rng = np.random.default_rng([chunk.number, 5])
    base = QUICKER.get(problem.name, {})

    def play(kwargs: dict[str, Any], orders: list[tuple[str, Any]]) -> str | None:
        env: Any = gymnasium.make_vec(problem.env_id(role), **{"num_envs": 3, **base, **kwargs})
        wrong = None
        for call, value in orders:
            wrong = wrong or _call(env, call, value, rng)
        return wrong

    for _ in range(INPUTS):
        kwargs = {NAMES[place]: _argument(NAMES[place], rng) for place in _few(rng, len(NAMES))}
        orders = [_order(rng) for _ in range(rng.integers(0, 6))]
        calls = ", ".join(f"{call} {in_words(value)}" for call, value in orders)
        what = f"{problem.name} {role} {shown(kwargs)}; calls: {calls}"
        tally.attempt(what, limited(lambda kwargs=kwargs, orders=orders: play(kwargs, orders)))  # type: ignore[misc]


def _few(rng: Generator, most: int) -> list[int]:
    return [int(place) for place in rng.choice(most, rng.integers(0, 3), replace=False)]


def _argument(name: str, rng: Generator) -> Any:
    value = odd_value(rng)[1]
    number = isinstance(value, int) and not isinstance(value, bool)
    if number and name in ("num_envs", "num_threads"):
        return min(value, MOST_ENVS if name == "num_envs" else MOST_THREADS)
    return value


def _order(rng: Generator) -> tuple[str, Any]:
    call = pick(CALLS, rng)
    fine = {"step": None, "reset": None, "masked reset": np.array([True, False, True]), "seeded reset": [1, 2, 3]}
    value = odd_value(rng)[1] if rng.random() < 0.4 and call not in ("step", "reset") else fine.get(call)
    return call, value


def _call(env: Any, call: str, value: Any, rng: Generator) -> str | None:
    if call == "step":
        actions = legal_batch(env.single_action_space, env.num_envs, rng)
        observation, rewards, *_ = env.step(actions)
        return wrong_numbers(observation, rewards)
    if call == "render":
        env.render()
    elif call == "close":
        env.close()
    else:
        options = {"reset_mask": value} if call == "masked reset" else None
        observation, _ = env.reset(seed=value if call == "seeded reset" else None, options=options)
        return wrong_numbers(observation, 0.0)
    return None
