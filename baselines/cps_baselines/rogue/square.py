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

    A hold in which the wave switches gets its mean effort. Where several vehicles are seized, each one drives the wave
    of the one behind it, later by the share `shift` of a period: at 0.5 neighbors of three rams and brakes by turns.
    `frequency_hz`, `duty` and `shift`: numbers, or (B,) one per episode.

    Raises:
        ConfigurationError: a frequency that is not above 0, a duty outside (0, 1], or a shift outside [0, 1].
    """

    def __init__(
        self,
        spec: RoleSpec,
        frequency_hz: float | FloatArray = 0.1,
        duty: float | FloatArray = 0.5,
        shift: float | FloatArray = 0.0,
    ) -> None:
        super().__init__(spec)
        self.frequency_hz, self.duty = np.atleast_1d(frequency_hz).astype(float), np.atleast_1d(duty).astype(float)
        self.shift = np.atleast_1d(shift).astype(float)
        if not (np.all(self.frequency_hz > 0) and np.all((self.duty > 0) & (self.duty <= 1))):
            raise ConfigurationError(
                f"a square wave needs frequency_hz > 0 and 0 < duty <= 1; got {frequency_hz} and {duty}"
            )
        if not np.all((self.shift >= 0) & (self.shift <= 1)):
            raise ConfigurationError(f"shift = {shift} has to be a share of a period, from 0 to 1")
        self._bodies = bodies_of(spec.config)
        self._times = pack(Times(spec.config.duration_s, spec.decision_interval_s))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, seats); the state holds the onsets (B,) in s, which are observed until they have passed."""
        actions, onset_s = np.empty((len(seen), *self.spec.neutral_action.shape)), np.empty(len(seen))
        start, known_s = (seen.start, state[0]) if state else (np.ones(len(seen), np.bool_), onset_s)
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale, start, known_s)
        _wave(*shown, self.frequency_hz, self.duty, self.shift, self._times, self._bodies, onset_s, actions)
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
    shifts: FloatArray,
    times: Array,
    bodies: Array,
    onset_s: FloatArray,
    actions: FloatArray,
) -> None:
    """Fill the onsets (B,) and the actions (B, seats); those of the last decision are `known_s`."""
    at, t = offsets[0], unpack(Times, times, 0)
    for b in range(start.size):
        left_s = read(observation, scale, b, at.time_left_s)
        begin_s = np.rint((t.duration_s - left_s) / t.hold_s) * t.hold_s
        onset_s[b] = begin_s + read(observation, scale, b, at.until_onset_s) if start[b] else known_s[b]
        frequency_hz, duty = frequencies_hz[b % frequencies_hz.size], duties[b % duties.size]
        ratio, later_s = read(observation, scale, b, at.power_ratio), shifts[b % shifts.size] / frequency_hz
        for seat in range(actions.shape[1]):
            e = body_of(bodies, int(read(observation, scale, b, at.attacker_index + seat) - 0.5))
            since_s = begin_s - onset_s[b] - seat * later_s
            driving_s = driving(since_s + t.hold_s, frequency_hz, duty) - driving(since_s, frequency_hz, duty)
            effort = e.min_effort + clip(driving_s / t.hold_s, 0.0, 1.0) * (e.max_effort - e.min_effort)
            actions[b, seat] = action_for(effort, read(observation, scale, b, at.speed + seat), ratio, e)


@inlined
def driving(time_s: float, frequency_hz: float, duty: float) -> float:
    """Time at F+ from the onset on, s."""
    phase = frequency_hz * time_s
    return (floor(phase) * duty + min(phase % 1.0, duty)) / frequency_hz


def duty_square(spec: RoleSpec, frequency_hz: float = 0.1, duty: float = LONG_DUTY) -> SquareWave:
    """Drives a square wave that accelerates longer than it brakes, so that drag does not stop the attacker."""
    return SquareWave(spec, frequency_hz, duty)
