"""Decisions taken together and environments stepped side by side give what they give one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.interfaces import episode_of
from cps_envs.core.conformance.recording import assert_same, record, replay
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.errors import ConfigurationError

SKIP = 3


def check_frame_skip(subject: Subject) -> None:
    """A step with `frame_skip=k` is k single steps with the same action, bit for bit; it ends where an episode does.

    The reward is the sum of theirs. An action that becomes illegal on the way is played nevertheless, as it is there.
    """
    seed = 27
    actions, skipped = record(subject.single(frame_skip=SKIP), seed=seed)
    single = subject.single()
    expected: list[tuple[Any, ...]] = [single.reset(seed=seed)]
    for action in actions:
        total = 0.0
        for _ in range(SKIP):
            observation, reward, terminated, truncated, info = single.step(action)
            total += reward
            if terminated or truncated:
                break
        expected.append((observation, total, terminated, truncated, info))
        if terminated or truncated:
            break
    assert_same(expected, skipped, f"a step with frame_skip={SKIP} is not {SKIP} single steps")
    batch = subject.batch(frame_skip=SKIP, autoreset_mode=AutoresetMode.NEXT_STEP)
    results = replay(batch, [np.stack([action] * NUM_ENVS) for action in actions], seed=seed)
    first = [episode_of(result, 0) for result in results]
    assert_same(expected, first, f"a batch with frame_skip={SKIP} is not the single environment")


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
