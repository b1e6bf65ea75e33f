"""Arguments that several interfaces take."""

from __future__ import annotations

from cps_envs.core.errors import ConfigurationError


def check_frame_skip(frame_skip: int) -> int:
    """How many decisions an action is held for.

    Raises:
        ConfigurationError: no whole number, or fewer than one.
    """
    if isinstance(frame_skip, bool) or not isinstance(frame_skip, int) or frame_skip < 1:
        raise ConfigurationError(f"frame_skip = {frame_skip!r} must be a whole number of decisions, at least 1")
    return frame_skip
