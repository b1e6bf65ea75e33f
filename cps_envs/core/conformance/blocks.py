"""Decisions taken together and environments stepped side by side give what they give one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.interfaces import episode_of, settled
from cps_envs.core.conformance.recording import assert_same, record, replay
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter, adapter_of

SKIP = 3


def check_frame_skip(subject: Subject) -> None:
    """A step with `frame_skip=k` is k single steps with the same action, bit for bit; it ends where an episode does.

    The reward is the sum of theirs. An action that becomes illegal on the way is played nevertheless, as it is there.

    Raises:
        NotApplicableError: in the interface for learners agents pause, and one that pauses decides nothing.
    """
    seed, single = 27, subject.single()
    alike = {"frame_skip": SKIP * single.frame_skip, **_scaling_of(single)}
    actions, skipped = record(subject.single(**alike), seed=seed)
    expected: list[tuple[Any, ...]] = [single.reset(seed=seed)]
    for action in actions:
        total, cost = 0.0, 0.0
        for _ in range(SKIP):
            observation, reward, terminated, truncated, info = single.step(action)
            total, cost = total + reward, cost + info.get("cost", 0.0)
            if terminated or truncated:
                break
        if "cost" in info:
            info["cost"] = settled(cost, skipped[min(len(expected), len(skipped) - 1)][-1]["cost"])
        expected.append((observation, total, terminated, truncated, info))
        if terminated or truncated:
            break
    assert_same(expected, skipped, f"a step with frame_skip={SKIP} is not {SKIP} single steps")
    batch = subject.batch(**alike, autoreset=AutoresetMode.NEXT_STEP)
    results = replay(batch, [np.stack([action] * NUM_ENVS) for action in actions], seed=seed)
    first = [episode_of(result, 0) for result in results]
    assert_same(expected, first, f"a batch with frame_skip={SKIP} is not the single environment")


def _scaling_of(env: Any) -> dict[str, Any]:
    """The scale of an environment's inputs, for others that are to see the same."""
    if env.interface == NATIVE:
        return {}
    wiring = env.observation_space.wiring
    if type(adapter_of(env.game.spec(env.role), wiring.adapter)).active is not Adapter.active:
        raise NotApplicableError("agents pause, so a longer step is another one")
    return {"scaling": (wiring.mean, wiring.deviation)}


def check_threads(subject: Subject) -> None:
    """A batch in several threads is the batch in one, bit for bit.

    Raises:
        NotApplicableError: the game runs in one thread.
    """
    try:
        subject.batch(NUM_ENVS, num_threads=2)
    except ConfigurationError as error:
        raise NotApplicableError(f"no threads: {error}") from error
    for num_envs in (2, 2 * NUM_ENVS + 1):
        runs = []
        for num_threads in (1, 2, NUM_ENVS):
            env = subject.batch(num_envs, num_threads=num_threads)
            env.game.threads.worth_s = 0.0  # so little work would not be split
            runs.append(record(env, seed=28)[1])
        for run in runs[1:]:
            assert_same(runs[0], run, f"a batch of {num_envs} depends on the number of threads")
