"""Defenders that correct commands, and the simplest of them: copying the disbanded vehicle ahead."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import Record, borrowed, inlined, kernel, lend
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation

SPEED_MATCHING = 1.0  # 1/s, chosen; 0.5 to 4 give the same errors within 0.1 points
DISBANDED = 0.5  # of an entry that is 0 or 1


class Layout(NamedTuple):
    """How an observation of the defender is to be read."""

    offsets: Array  # (1,) see `Fields.offsets`
    scale: FloatArray  # (2, size) see `Fields.scale`


class Sight(NamedTuple):
    """What a controller reads of one episode in physical units, (M,); the front vehicle has nobody ahead."""

    speed: FloatArray  # m/s
    acceleration: FloatArray  # m/s2
    gap: FloatArray  # m
    relative_speed: FloatArray  # m/s, the predecessor's minus the own
    law_command: FloatArray  # m/s2
    ahead_speed: FloatArray  # m/s, of the nearest disbanded vehicle ahead
    ahead_command: FloatArray  # m/s2, of that vehicle
    mitigable: BoolArray


class Corrections(AnalyticPolicy):
    """Base of central defenders: one correction in m/s2 for each vehicle.

    Raises:
        ConfigurationError: the environment takes one correction per platoon.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config = spec.config
        if config.defense_action != "vehicle":
            raise ConfigurationError(f'{type(self).__name__} corrects vehicles; it needs defense_action="vehicle"')
        self.limit_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        self.layout = Layout(spec.fields.offsets, spec.fields.scale)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, M): corrections as shares of u_max - u_min; zero where none would act."""
        actions = np.zeros((len(seen), self.spec.config.max_vehicles))
        if (seen["disbanded"] > DISBANDED).any():
            self.correct(seen, actions)
            np.clip(actions / self.limit_mps2, -1.0, 1.0, out=actions)
        return actions, state

    @abstractmethod
    def correct(self, seen: Seen, corrections: FloatArray) -> None:
        """Write the corrections (B, M) in m/s2 of mitigable vehicles; the others' stay zero."""


@inlined
def decoded(row: Observation, scale: FloatArray, entry: int) -> float:
    """An entry of an observation in its unit."""
    return float(row[entry] * scale[1, entry] + scale[0, entry])


@inlined
def sight_for(num_vehicles: int) -> Sight:
    """Room for a `Sight`; kernels make it once per call."""
    rows, mitigable = np.zeros((7, num_vehicles)), np.zeros(num_vehicles, np.bool_)
    return Sight(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], mitigable)


@kernel
def sight_of(row: Observation, layout: Layout, num_vehicles: int) -> Sight:
    """What a controller reads of an observation (size,), for Python."""
    sight = sight_for(num_vehicles)
    look(row, layout, sight)
    return sight


@inlined
def look(row: Observation, layout: Layout, sight: Sight) -> None:
    """Fill `sight` from an observation (size,)."""
    at, scale = layout.offsets[0], layout.scale
    size = sight.speed.size - (at.disbanded - at.mitigable)
    for q in range(sight.speed.size):
        sight.speed[q] = decoded(row, scale, at.speed + q)
        sight.acceleration[q] = decoded(row, scale, at.acceleration + q)
        sight.law_command[q] = decoded(row, scale, at.law_command + q)
    for q in range(1, sight.speed.size):
        sight.gap[q] = decoded(row, scale, at.gap + q - 1)
        sight.relative_speed[q] = decoded(row, scale, at.relative_speed + q - 1)
    for q in range(size, sight.speed.size):
        sight.mitigable[q] = decoded(row, scale, at.mitigable + q - size) > 0.5
    platoons = count_present(row, at, scale)
    for platoon in range(1, platoons):
        speed = decoded(row, scale, at.ahead_speed + platoons - 1 - platoon)
        command = decoded(row, scale, at.ahead_command + platoons - 1 - platoon)
        for q in range(platoon * size, (platoon + 1) * size):
            sight.ahead_speed[q], sight.ahead_command[q] = speed, command


@inlined
def count_present(row: Observation, at: Record, scale: FloatArray) -> int:
    """How many platoons there are: all, unless their number is drawn and seen."""
    count = 0
    for entry in range(at.present, at.time_s):
        count += decoded(row, scale, entry) > 0.5
    return count if at.time_s > at.present else at.ahead_speed - at.disbanded


class CopyDisbanded(Corrections):
    """Extension beyond the paper: every vehicle copies the command of the nearest disbanded vehicle ahead.

    Needs a broadcast of that command and of that vehicle's speed. Copying keeps the gaps of the steady state, and its
    error is that of the vehicle copied, whatever the number of platoons. A bounded correction cannot follow a driver
    who commands -90 m/s2, so the speed that is lost at first is matched again at `SPEED_MATCHING`.
    """

    def correct(self, seen: Seen, corrections: FloatArray) -> None:
        """The copied command, with the speeds matched, minus the controller's."""
        _copy_disbanded(seen.observation, self.layout, corrections)


@kernel
def _copy_disbanded(observation: Observation, layout: Layout, corrections: FloatArray) -> None:
    sight = sight_for(corrections.shape[1])
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), sight)
        for q in range(corrections.shape[1]):
            if sight.mitigable[q]:
                lag = sight.ahead_speed[q] - sight.speed[q]
                corrections[b, q] = sight.ahead_command[q] + SPEED_MATCHING * lag - sight.law_command[q]
