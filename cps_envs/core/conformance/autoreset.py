"""Batches start ended environments anew as Gymnasium says, and only the environments that are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import EXTRA_STEPS, difference, episode_steps
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.types import Array

NAMES = ("observation", "reward", "terminated", "truncated", "info")


def check_autoreset(subject: Subject) -> None:
    """All three autoreset modes equal Gymnasium's own SyncVectorEnv, with environments out of phase."""
    for mode in AutoresetMode:
        native = subject.batch(autoreset=mode)
        reference = SyncVectorEnv([partial(subject.single)] * NUM_ENVS, autoreset_mode=mode)
        assert native.metadata.get("autoreset_mode") == mode, f"metadata['autoreset_mode'] has to be {mode}"
        _compare(native, reference, mode)


def _compare(native: Any, reference: SyncVectorEnv, mode: AutoresetMode) -> None:
    crew, steps = Crew(native, 31), episode_steps(native)
    ours: tuple[Any, ...] = native.reset(seed=31)
    theirs: tuple[Any, ...] = reference.reset(seed=31)
    _assert_equal(ours, theirs, f"{mode}: after the first reset")
    ended = np.zeros(NUM_ENVS, np.bool_)
    for step in range(steps + max(EXTRA_STEPS, steps // 2)):
        staggered = step == max(1, steps // 3)  # one environment starts anew early, so that episodes end apart
        if staggered or (mode == AutoresetMode.DISABLED and ended.any()):
            mask = ended | (np.arange(NUM_ENVS) == 1) if staggered else ended
            seeds = [None, 77, None] if staggered else None
            ours = native.reset(seed=seeds, options={"reset_mask": mask.copy()})
            theirs = reference.reset(seed=seeds, options={"reset_mask": mask.copy()})
            _assert_equal(ours, theirs, f"{mode}: after a reset of environments {np.flatnonzero(mask)} at step {step}")
        actions = crew.act({**ours[-1], **_all_masks(native)})
        ours, theirs = native.step(actions), reference.step(actions)
        _assert_equal(ours, theirs, f"{mode}: at step {step}")
        ended = ours[2] | ours[3]


def _all_masks(native: Any) -> dict[str, Array]:
    return {"action_mask": native.action_masks()} if hasattr(native, "action_masks") else {}


def _assert_equal(ours: tuple[Any, ...], theirs: tuple[Any, ...], message: str) -> None:
    for name, mine, expected in zip(NAMES[: len(ours) - 1], ours, theirs, strict=False):
        found = difference(mine, expected, name)
        assert found is None, f"{message} the batch (left) and a SyncVectorEnv of singles (right) differ: {found}"
    found = _info_difference(ours[-1], theirs[-1], "info")
    assert found is None, f"{message} the batch (left) and a SyncVectorEnv of singles (right) differ: {found}"


def _info_difference(ours: Mapping[str, Any], theirs: Mapping[str, Any], path: str) -> str | None:
    """Where two vector infos differ in keys, masks, or in values that the masks mark."""
    if set(ours) != set(theirs):
        return f"{path} has the keys {sorted(set(ours) ^ set(theirs))} on one side only"
    for key in (key for key in theirs if not key.startswith("_")):
        mine, expected, mask = ours[key], theirs[key], theirs[f"_{key}"]
        found = difference(ours[f"_{key}"], mask, f"{path}['_{key}']")
        if found is None and isinstance(expected, Mapping):
            found = _info_difference(mine, expected, f"{path}[{key!r}]")
        elif found is None:
            if key == "cost" and "_final_info" in theirs:  # ours is what the step has cost, as the reward is
                mask = mask & ~theirs["_final_info"]
            pairs = [(mine[b], expected[b]) for b in np.flatnonzero(mask)]
            left, right = ([np.asarray(pair[side]) for pair in pairs] for side in (0, 1))
            found = difference(left, right, f"{path}[{key!r}]")
        if found is not None:
            return found
    return None


def check_reset_mask(subject: Subject) -> None:
    """`options["reset_mask"]` restarts the marked environments and leaves the others alone; wrong masks are refused."""
    batch, twin = subject.batch(), subject.batch()
    crew = Crew(batch, 32)
    before: tuple[Any, ...] = batch.reset(seed=32)
    other: tuple[Any, ...] = twin.reset(seed=32)
    for _ in range(min(3, episode_steps(batch) - EXTRA_STEPS - 1)):
        actions = crew.act(before[-1])
        before, other = batch.step(actions), twin.step(actions)
    mask = np.arange(NUM_ENVS) == 1
    observation, _ = batch.reset(seed=[None, 99, None], options={"reset_mask": mask})
    for b in range(NUM_ENVS):
        expected = subject.single().reset(seed=99)[0] if mask[b] else other[0][b]
        found = difference(observation[b], expected)
        does = "does not start as the single environment does" if mask[b] else "is changed though it is not marked"
        assert found is None, f"environment {b} {does} when environment 1 is reset by a mask: {found}"
    _check_refusals(subject)


def _check_refusals(subject: Subject) -> None:
    batch = subject.batch()
    batch.reset(seed=0)
    for wrong in (
        np.ones(NUM_ENVS + 1, np.bool_),
        np.ones(NUM_ENVS, np.int64),
        np.zeros(NUM_ENVS, np.bool_),
        [True] * NUM_ENVS,
    ):
        try:
            batch.reset(options={"reset_mask": wrong})
        except (TypeError, ValueError, AssertionError):
            continue
        raise AssertionError(f'options["reset_mask"] = {wrong!r} has to be refused')


def check_time_limit(subject: Subject) -> None:
    """`max_episode_steps` truncates a batch as Gymnasium's TimeLimit truncates the single environment."""
    single = subject.single()
    if single.waits:
        raise NotApplicableError("steps differ in length, so nobody can limit their number")
    limit = max(1, (episode_steps(single) - 1) // 2)
    batch = subject.batch(autoreset=AutoresetMode.NEXT_STEP, max_episode_steps=limit)
    crew = Crew(batch, 33, boldness=0.0)
    result: tuple[Any, ...] = batch.reset(seed=33)
    for step in range(1, limit + 1):
        result = batch.step(crew.act(result[-1]))
        over = result[2] | result[3]
        if step < limit:
            if over.any():
                return  # episodes so short are ended by physics
        else:
            assert over.all(), f"max_episode_steps={limit} does not end the episodes of a batch after {limit} steps"
