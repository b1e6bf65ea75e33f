"""Arguments that several interfaces take."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError


def check_count(name: str, value: int) -> int:
    """A whole number of something, at least 1.

    Raises:
        ConfigurationError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ConfigurationError(f"{name} = {value!r} must be a whole number, at least 1")
    return int(value)
