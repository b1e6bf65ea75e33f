"""Attackers of chapter 5: full driving and full braking effort in turn, as a square wave (specification 4.7)."""

from __future__ import annotations

import numpy as np

from baselines.rogue.memory import recalled
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray
from cps_envs.rogue.actions import action_of_effort

LONG_DUTY = 0.85  # chosen: drag does not stop the vehicle in the long run, which half the time at F+ lets it do


class SquareWave(AnalyticPolicy):
    """F+ in the first `duty` share of each period and F- in the rest, from the onset of the attack on.

    A hold in which the wave switches gets its mean effort. `frequency_hz` and `duty`: numbers, or (B,) one per episode.

    Raises:
        ConfigurationError: a frequency that is not above 0, or a duty outside (0, 1].
    """

    def __init__(self, spec: RoleSpec, frequency_hz: float | FloatArray = 0.1, duty: float | FloatArray = 0.5) -> None:
        super().__init__(spec)
        self.frequency_hz, self.duty = np.asarray(frequency_hz, np.float64), np.asarray(duty, np.float64)
        if not (np.all(self.frequency_hz > 0) and np.all((self.duty > 0) & (self.duty <= 1))):
            raise ConfigurationError(
                f"a square wave needs frequency_hz > 0 and 0 < duty <= 1; got {frequency_hz} and {duty}"
            )

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The actions (B, 1); the state holds the onsets (B,) in s, which are observed until they have passed."""
        config, hold_s = self.spec.config, self.spec.decision_interval_s
        begin_s = np.round((config.duration_s - seen["time_left_s"]) / hold_s) * hold_s
        onset_s = recalled(begin_s + seen["until_onset_s"], seen, state)
        since_s = begin_s - onset_s
        share = np.clip((self._driving_s(since_s + hold_s) - self._driving_s(since_s)) / hold_s, 0.0, 1.0)
        effort = config.min_effort + share * (config.max_effort - config.min_effort)
        return action_of_effort(effort, seen["speed"], seen["power_ratio"], config)[:, np.newaxis], (onset_s,)

    def _driving_s(self, time_s: FloatArray) -> FloatArray:
        """Time at F+ (B,) from the onset on, s."""
        phase = self.frequency_hz * time_s
        driving: FloatArray = (np.floor(phase) * self.duty + np.minimum(phase % 1, self.duty)) / self.frequency_hz
        return driving


def duty_square(spec: RoleSpec, frequency_hz: float = 0.1, duty: float = LONG_DUTY) -> SquareWave:
    """A square wave that drives longer than it brakes, so that drag does not bring the attacker to rest."""
    return SquareWave(spec, frequency_hz, duty)
