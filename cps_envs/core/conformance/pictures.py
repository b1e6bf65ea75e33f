"""Pictures come as arrays, without a display, and do not disturb the episode."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.conformance.recording import assert_same, record, replay
from cps_envs.core.conformance.subject import NotApplicableError, Subject
from cps_envs.core.errors import MissingExtraError

FRAMES = 3


def check_rendering(subject: Subject) -> None:
    """Mode `rgb_array` gives fresh uint8 frames (H, W, 3) of constant size and leaves the trajectory alone.

    Raises:
        NotApplicableError: the problem has no viewer, or its drawing package is not installed.
    """
    if not subject.problem.viewer:
        raise NotApplicableError("nothing draws this problem: it names no viewer")
    actions, expected = record(subject.single(), seed=95)
    env = subject.single(render_mode="rgb_array")
    frames: list[Any] = []
    kept: list[Any] = []
    results: list[Any] = []
    for step, result in enumerate(replay(env, actions, seed=95)):
        results.append(result)
        if step < FRAMES or step == len(actions):
            try:
                frames.append(env.render())
            except (MissingExtraError, ModuleNotFoundError) as error:
                raise NotApplicableError(f"nothing draws this problem: {error}") from error
            kept.append(np.copy(frames[-1]))
    env.close()
    for frame, copied in zip(frames, kept, strict=True):
        kind = getattr(frame, "dtype", type(frame))
        assert kind == np.uint8, f"a frame has to be an array of uint8, not {kind}"
        assert frame.shape[2:] == (3,), f"a frame has shape {frame.shape}, not (H, W, 3)"
        assert frame.shape == frames[0].shape, f"frames change their size from {frames[0].shape} to {frame.shape}"
        assert np.array_equal(frame, copied), "a frame is overwritten by a later one"
    assert not np.array_equal(frames[0], frames[-1]), "the first and the last frame of an episode are the same picture"
    assert_same(expected, results, "rendering changes the trajectory")
