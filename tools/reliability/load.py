"""Long runs: no memory is lost, and nothing that comes back is ever wrong; also other processes, threads and copies."""

from __future__ import annotations

import os
import pickle
import resource
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv

from cps_envs import PROBLEMS
from cps_envs.core.conformance.actors import Crew
from cps_envs.core.types import ROLES, Array
from tools.reliability.chunk import Chunk, Part, Result
from tools.reliability.journal import Journal

EPISODES, BATCH_STEPS, BATCH_CHUNKS = 1024, 1_000_000, 10  # side by side; steps of a chunk, all together; chunks
SINGLE_STEPS, SINGLE_CHUNKS = 100_000, 10
COPIED_STEPS = 40
POOL = 32  # batches of random actions, used in turn
NOTED = 100  # calls between two signs of life
WARM_UP = 0.2  # share of the steps after which memory is looked at for the first time
SPARE_KB = 8 * 1024  # growth that is no leak
PRESET = "learning"
IDS = tuple(problem.env_id(role) for problem in PROBLEMS.values() for role in ROLES)


def chunks() -> list[Chunk]:
    """For each environment: steps of a batch, steps of a single one, and other processes, threads and copies."""
    code = ("cps_envs", "baselines/cps_baselines", "tools/reliability/load.py")
    found = [
        Chunk("load", f"{env_id}, {form}", i, code) for form, n in FORMS.items() for env_id in IDS for i in range(n)
    ]
    return sorted(found, key=lambda chunk: chunk.number)


def run(chunk: Chunk, journal: Journal) -> Result:
    """Do one of them."""
    env_id, _, form = chunk.row.partition(", ")
    return TRIALS[form](env_id, chunk.number, journal)


def batch(env_id: str, number: int, journal: Journal) -> Result:
    """Random actions, legal or not, in a batch that resets itself."""
    env: Any = gymnasium.make_vec(env_id, num_envs=EPISODES, preset=PRESET, interface="native")
    env.action_space.seed(number)
    actions = [env.action_space.sample() for _ in range(POOL)]
    env.reset(seed=number * EPISODES)
    return _long(lambda place: env.step(actions[place % POOL])[:2], BATCH_STEPS // EPISODES + 1, EPISODES, journal)


def single(env_id: str, number: int, journal: Journal) -> Result:
    """The same in one environment that is reset when its episode has ended."""
    env: Any = gymnasium.make(env_id, preset=PRESET, interface="native", disable_env_checker=True)
    env.action_space.seed(number)
    actions = [env.action_space.sample() for _ in range(POOL)]
    env.reset(seed=number)

    def step(place: int) -> tuple[Array, Any]:
        observation, reward, terminated, truncated, _ = env.step(actions[place % POOL])
        if terminated or truncated:
            env.reset()
        return observation, reward

    return _long(step, SINGLE_STEPS, 1, journal)


def _long(step: Callable[[int], tuple[Array, Any]], calls: int, size: int, journal: Journal) -> Result:
    counts = {"steps": calls * size, "not_finite": 0, "outside": 0, "leak": 0}
    start = 0
    for place in range(calls):
        observation, rewards = step(place)
        largest = np.abs(observation).max()
        if not largest <= 1:
            counts["not_finite" if np.isnan(largest) else "outside"] += 1
        if not np.isfinite(rewards).all():
            counts["not_finite"] += 1
        if place == int(WARM_UP * calls):
            start = _memory_kb()
        if place % NOTED == 0:
            journal.begin(place, "steps")
    growth = _memory_kb() - start
    counts |= {"growth_kb": max(growth, 0), "leak": int(growth > SPARE_KB)}
    return {"counts": counts, "examples": {"leak": f"memory grew by {growth} kB"} if counts["leak"] else {}}


def _memory_kb() -> int:
    """The memory that this process holds now, where the system tells; else the most that it has held."""
    status = Path("/proc/self/statm")
    if status.is_file():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def copies(env_id: str, number: int, journal: Journal) -> Result:
    """Other processes (by fork and by spawn), threads, and a pickle in the middle: the trajectory is the same."""
    make = partial(gymnasium.make, f"cps_envs:{env_id}", preset=PRESET, interface="native")
    steps = _trajectory(gymnasium.make_vec(env_id, num_envs=4, preset=PRESET, interface="native"))
    different = []
    for context in ("fork", "spawn"):
        other = AsyncVectorEnv([make] * 4, context=context)
        try:
            different += [] if _trajectory(other) == steps else [f"AsyncVectorEnv by {context}"]
        finally:
            other.close()
    if _trajectory(gymnasium.make_vec(env_id, num_envs=4, preset=PRESET, interface="native"), copied=True) != steps:
        different.append("pickled in the middle")
    counts = {"steps": 4 * COPIED_STEPS * 4, "different": len(different)}
    return {"counts": counts, "examples": {"different": f"{env_id}: {', '.join(different)}"} if different else {}}


def _trajectory(env: Any, *, copied: bool = False) -> list[bytes]:
    """What comes back under fixed actions, of episodes that are still in their first steps."""
    env.action_space.seed(3)
    seen = [env.reset(seed=7)[0].tobytes()]
    for step in range(COPIED_STEPS):
        if copied and step == COPIED_STEPS // 2:
            env = pickle.loads(pickle.dumps(env))
        observation, rewards, terminated, truncated, _ = env.step(env.action_space.sample())
        arrays = (observation, np.asarray(rewards, np.float64), terminated, truncated)
        seen += [np.ascontiguousarray(array).tobytes() for array in arrays]
    return seen


def threads(env_id: str, number: int, journal: Journal) -> Result:
    """Environments stepped in several threads, where the game can, equal those stepped in one."""
    env: Any = gymnasium.make_vec(env_id, num_envs=64, preset=PRESET, interface="native")
    if not env.game.threaded:
        return {"counts": {}, "examples": {}}
    alone = _crewed(env)
    together = _crewed(gymnasium.make_vec(env_id, num_envs=64, preset=PRESET, interface="native", num_threads=4))
    counts = {"steps": 2 * 64 * COPIED_STEPS, "different": int(alone != together)}
    return {"counts": counts, "examples": {"different": f"{env_id}: four threads"} if alone != together else {}}


def _crewed(env: Any) -> list[bytes]:
    crew, seen = Crew(env, 1), []
    _, info = env.reset(seed=7)
    for _ in range(COPIED_STEPS):
        observation, rewards, _, _, info = env.step(crew.act(info))
        seen += [observation.tobytes(), rewards.tobytes()]
    return seen


FORMS: Mapping[str, int] = {"batch of 1,024": BATCH_CHUNKS, "one": SINGLE_CHUNKS, "copies": 1, "threads": 1}
TRIALS: Mapping[str, Callable[[str, int, Journal], Result]] = {
    "batch of 1,024": batch,
    "one": single,
    "copies": copies,
    "threads": threads,
}
PART = Part(
    name="load",
    title="Long runs",
    about=(
        f"Each environment (preset `{PRESET}`) runs for millions of steps under random actions, as a batch of 1,024 "
        "and alone. Every observation and reward is looked at. Memory may not grow by more than 8 MB after the first "
        "fifth of a run. Copies are the same episodes in other processes (AsyncVectorEnv by fork and by spawn) and "
        "after a pickle in the middle; threads are four threads instead of one. Both must give the same trajectories."
    ),
    columns={
        "steps": "steps",
        "growth_kb": "growth of memory, kB",
        "not_finite": "not finite",
        "outside": "outside the space",
        "leak": "runs that lose memory",
        "different": "different trajectory",
    },
    forbidden=frozenset({"not_finite", "outside", "leak", "different"}),
    chunks=chunks,
    run=run,
)
