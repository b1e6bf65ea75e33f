"""How corrections of the defender meet the limits of the commands."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cps_envs.fdi.dynamics import correct


@pytest.mark.parametrize(
    ("limited", "clips", "command", "applied"),
    [
        (False, False, [9.0, 4.0, -1.0], [5.0, 0.0, -2.0]),  # nothing stands in the way
        (True, False, [3.0, 4.0, -1.0], [-1.0, 0.0, -2.0]),  # what is corrected keeps to the limits, the law may not
        (True, True, [3.0, 3.0, -1.0], [5.0, 0.0, -2.0]),  # the actuator clips everything
    ],
)
def test_a_correction_goes_as_far_as_the_limits(
    limited: bool, clips: bool, command: list[float], applied: list[float]
) -> None:
    episode: Any = SimpleNamespace(command=np.array([4.0, 4.0, 1.0]), correction=np.zeros(3))
    limits: Any = SimpleNamespace(
        limit_commands=limited, clips=clips, min_acceleration_mps2=-3.0, max_acceleration_mps2=3.0
    )
    correct(episode, limits, np.array([5.0, 0.0, -2.0]))
    assert episode.command.tolist() == command
    assert episode.correction.tolist() == applied
