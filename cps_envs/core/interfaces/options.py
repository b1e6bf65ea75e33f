"""Arguments that several interfaces take."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.errors import ConfigurationError, shown


def check_count(name: str, value: int) -> int:
    """A whole number of something, at least 1.

    Raises:
        ConfigurationError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ConfigurationError(f"{name} = {shown(value)} must be a whole number, at least 1")
    return int(value)


def check_options(options: Any) -> None:
    """What `reset` takes as options; unknown entries are allowed, as Gymnasium wants it.

    Raises:
        ValueError: they are no dictionary.
    """
    if options is not None and not isinstance(options, dict):
        raise ValueError(f"options = {shown(options)} must be a dictionary, such as {{'reset_mask': mask}}")


def check_autoreset(mode: str | AutoresetMode) -> AutoresetMode:
    """When an ended environment starts again.

    Raises:
        ConfigurationError: there is no such mode.
    """
    try:
        return AutoresetMode(mode)
    except (ValueError, TypeError, RecursionError) as error:
        known = ", ".join(each.value for each in AutoresetMode)
        raise ConfigurationError(f"autoreset_mode = {shown(mode)} must be one of {known}") from error
