"""Attackers of chapter 5: full driving and full braking effort in turn, as a square wave (specification 4.7)."""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import clip, inlined, kernel, pack, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, State
from cps_envs.rogue.actions import action_for, bodies_of, body_of
from cps_envs.rogue.reading import read

LONG_DUTY = 0.85  # chosen: drag does not stop the vehicle in the long run, which half the time at F+ lets it do


class Times(NamedTuple):
    """The length of an episode and of a decision."""

    duration_s: float
    hold_s: float  # between two decisions


class SquareWave(AnalyticPolicy):
    """Drives a square wave: full driving in the first `duty` share of each period, full braking in the rest.

    A hold in which the wave switches gets its mean effort. `frequency_hz` and `duty`: numbers, or (B,) one per episode.

    Raises:
        ConfigurationError: a frequency that is not above 0, or a duty outside (0, 1].
    """

    def __init__(self, spec: RoleSpec, frequency_hz: float | FloatArray = 0.1, duty: float | FloatArray = 0.5) -> None:
        super().__init__(spec)
        self.frequency_hz, self.duty = np.atleast_1d(frequency_hz).astype(float), np.atleast_1d(duty).astype(float)
        if not (np.all(self.frequency_hz > 0) and np.all((self.duty > 0) & (self.duty <= 1))):
            raise ConfigurationError(
                f"a square wave needs frequency_hz > 0 and 0 < duty <= 1; got {frequency_hz} and {duty}"
            )
        self._bodies = bodies_of(spec.config)
        self._times = pack(Times(spec.config.duration_s, spec.decision_interval_s))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, 1); the state holds the onsets (B,) in s, which are observed until they have passed."""
        actions, onset_s = np.empty((len(seen), 1)), np.empty(len(seen))
        start, known_s = (seen.start, state[0]) if state else (np.ones(len(seen), np.bool_), onset_s)
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale, start, known_s)
        _wave(*shown, self.frequency_hz, self.duty, self._times, self._bodies, onset_s, actions)
        return actions, (onset_s,)


@kernel
def _wave(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    start: BoolArray,
    known_s: FloatArray,
    frequencies_hz: FloatArray,
    duties: FloatArray,
    times: Array,
    bodies: Array,
    onset_s: FloatArray,
    actions: FloatArray,
) -> None:
    """Fill the onsets (B,) and the actions (B, 1); those of the last decision are `known_s`."""
    at, t = offsets[0], unpack(Times, times, 0)
    for b in range(start.size):
        e = body_of(bodies, int(read(observation, scale, b, at.attacker_index) - 0.5))
        left_s = read(observation, scale, b, at.time_left_s)
        begin_s = np.rint((t.duration_s - left_s) / t.hold_s) * t.hold_s
        onset_s[b] = begin_s + read(observation, scale, b, at.until_onset_s) if start[b] else known_s[b]
        since_s, frequency_hz = begin_s - onset_s[b], frequencies_hz[b % frequencies_hz.size]
        duty = duties[b % duties.size]
        driving_s = driving(since_s + t.hold_s, frequency_hz, duty) - driving(since_s, frequency_hz, duty)
        effort = e.min_effort + clip(driving_s / t.hold_s, 0.0, 1.0) * (e.max_effort - e.min_effort)
        speed, ratio = read(observation, scale, b, at.speed), read(observation, scale, b, at.power_ratio)
        actions[b, 0] = action_for(effort, speed, ratio, e)


@inlined
def driving(time_s: float, frequency_hz: float, duty: float) -> float:
    """Time at F+ from the onset on, s."""
    phase = frequency_hz * time_s
    return (floor(phase) * duty + min(phase % 1.0, duty)) / frequency_hz


def duty_square(spec: RoleSpec, frequency_hz: float = 0.1, duty: float = LONG_DUTY) -> SquareWave:
    """Drives a square wave that accelerates longer than it brakes, so that drag does not stop the attacker."""
    return SquareWave(spec, frequency_hz, duty)
