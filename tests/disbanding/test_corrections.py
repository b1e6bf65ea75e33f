"""How a correction enters a command: with a jump at the dead band, or growing from zero."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.types import Array, FloatArray
from cps_envs.disbanding.config import PAPER, PRESETS
from cps_envs.disbanding.controllers import DEAD_BAND, corrected
from tests.disbanding.rounds import played

LOW, HIGH = -5.0, 1.0
COMMANDS, CORRECTIONS = st.floats(-100, 100), st.floats(-6, 6)


class Jitter:
    """Corrections of its own for every vehicle, drawn anew at each decision with a deviation in m/s2."""

    def __init__(self, deviation_mps2: float) -> None:
        self._share, self._generator = deviation_mps2 / 6.0, np.random.default_rng(0)

    def predict(
        self, observation: Array, state: object = None, episode_start: object = None, deterministic: bool = False
    ) -> tuple[Array, None]:
        return self._share * self._generator.standard_normal((len(observation), 100)), None


@given(COMMANDS, CORRECTIONS, st.floats(-1, 1))
def test_without_a_full_size_a_correction_jumps_in(command: float, correction: float, noise: float) -> None:
    found = corrected(command, correction, noise, 0.0, LOW, HIGH)
    acts = abs(correction) >= DEAD_BAND
    assert found == (np.clip(command, LOW, HIGH) + correction + noise if acts else command)


@given(COMMANDS, CORRECTIONS, st.floats(-1, 1), st.floats(0.1, 5))
def test_a_correction_grows_from_nothing_to_the_full_rule(
    command: float, correction: float, noise: float, full: float
) -> None:
    assert corrected(command, 0.0, noise, full, LOW, HIGH) == command
    found = corrected(command, correction, noise, full, LOW, HIGH)
    if abs(correction) >= full:
        assert found == pytest.approx(corrected(command, correction, noise, 0.0, LOW, HIGH), abs=1e-9)
    steepest = 1 + (abs(command - np.clip(command, LOW, HIGH)) + abs(noise)) / full
    assert abs(found - command) <= steepest * abs(correction) + 1e-9


def test_only_the_preset_learning_has_the_new_rule() -> None:
    assert {name for name, config in PRESETS.items() if config.full_correction_mps2 > 0} == {"learning"}
    assert PAPER.full_correction_mps2 == 0


def cost_of(deviation_mps2: float, full_correction_mps2: float, count: int = 12) -> float:
    """Points by which small corrections at random are worse than none."""

    def paid(defender: object) -> FloatArray:
        return played(defender=defender, count=count, full_correction_mps2=full_correction_mps2)[0]

    return float((paid(Jitter(deviation_mps2)) - paid("none")).mean())


def test_small_corrections_cost_little() -> None:
    assert cost_of(0.1, PRESETS["learning"].full_correction_mps2) < 0.4
    assert cost_of(0.1, 0.0) > 1.5
