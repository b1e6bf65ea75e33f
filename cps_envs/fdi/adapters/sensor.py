"""The defence as a team: each sensor decides whether its own readings are believed, those in front also to brake."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, inlined, kernel, room
from cps_envs.core.declare.fields import Field, Fields, decode_entry, encode_row
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, Observation, State
from cps_envs.fdi.adapters.bending import COMMAND_MPS2, GAP_M, SPEED_MPS, bent, bent_field
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.team import check_duel, sensor_gaps, sensor_names

MOST_DEVIATIONS = 3.0  # an innovation beyond it is a lie in any case; chosen
MOST_OF_MEANS = 2.0  # deviations of means over sensors; chosen
MOST_SQUARE = 10.0  # chosen
BRAKES = (0.0, 0.5, 1.0)  # parts of the largest correction, which is 2 m/s2 in preset `learning`; chosen


class Sight(NamedTuple):
    """What kernels know of a defender's observation, and of what they make of it."""

    gaps: IntArray  # (A,) the gap that each sensor measures, 0 = ahead of the last vehicle
    partners: IntArray  # (A,) the other sensor of this gap, -1 where there is none
    offsets: Array  # (1,) where the fields of the role begin
    scale: FloatArray  # (2, size) of their encoding
    own_offsets: Array  # (1,) where the fields of the adapter begin
    own_scale: FloatArray  # (2, m)


class Sensor(Adapter):
    """Agents: the front sensors of vehicles 1..n (1 = last), then the rear sensors of 2..n.

    MultiDiscrete (2, 2, 3): believe the own range, the own range-rate (1), or replace it by the filter's estimate (0);
    0 brakes not at all, 1 and 2 brake the vehicle by half of the largest correction and by all of it. Only the sensor
    at a vehicle's front can brake it: the last entry of a rear sensor does nothing.
    """

    def __init__(self, spec: RoleSpec) -> None:
        """Take a role in a duel.

        Raises:
            ConfigurationError: there is no filter, or the payoff is not the impact speed.
        """
        super().__init__(spec)
        config: FdiConfig = spec.config
        check_duel(config)
        n = config.num_vehicles
        self.agents, self.fields = sensor_names(n), sensor_fields(config)
        self.action_space = spaces.MultiDiscrete([2, 2, len(BRAKES)])
        self.neutral_action = np.array([1, 1, 0])
        levels = config.correction_levels
        self._corrections: IntArray = np.array([levels - round(part * levels) for part in BRAKES])
        self._sight = hold(
            Sight(
                gaps=sensor_gaps(n),
                partners=np.r_[n : 2 * n - 1, -1, : n - 1],
                offsets=spec.fields.offsets,
                scale=spec.fields.scale,
                own_offsets=self.fields.offsets,
                own_scale=self.fields.scale,
            )
        )

    def observe(self, seen: Seen, state: State) -> Observation:
        """What `sensor_fields` describe, (B, A, m)."""
        shown = np.empty((len(seen), len(self.agents), self.fields.size), np.float32)
        _observe(self._sight, seen.observation, shown)
        return shown

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The defender's action (B, R + n): the agents' beliefs, ranges first, and how the vehicles brake."""
        fronts = actions[:, : self.spec.config.num_vehicles]
        return np.concatenate([actions[..., 0], actions[..., 1], self._corrections[fronts[..., 2]]], axis=1), state


def sensor_fields(config: FdiConfig) -> Fields:
    """What a sensor and the filter say of a gap; where a sensor has no partner, zeros in its place."""
    z, most, n = MOST_DEVIATIONS, MOST_OF_MEANS, config.num_vehicles
    return Fields(
        Field("range_z", "deviations", -z, z, (), "innovation of the own range"),
        Field("rate_z", "deviations", -z, z, (), "innovation of the own range-rate"),
        Field("range_z2", "-", 0, MOST_SQUARE, (), "its square, also of larger ones"),
        Field("rate_z2", "-", 0, MOST_SQUARE, (), "its square, also of larger ones"),
        Field("partner_range_z", "deviations", -z, z, (), "innovation of the range of the other sensor of the gap"),
        Field("partner_rate_z", "deviations", -z, z, (), "innovation of its range-rate"),
        Field("worst_range_z", "deviations", 0, z, (), "the largest size of an innovation of all ranges"),
        Field("worst_rate_z", "deviations", 0, z, (), "the largest size of an innovation of all range-rates"),
        Field(
            "ahead_rate_z",
            "deviations",
            -most,
            most,
            (),
            "mean innovation of the range-rates of the gap ahead of this one",
        ),
        Field("behind_rate_z", "deviations", -most, most, (), "mean innovation of those of the gap behind this one"),
        Field(
            "platoon_range_z", "deviations", -most, most, (), "innovation of how far all vehicles are ahead, on average"
        ),
        Field("platoon_rate_z", "deviations", -most, most, (), "innovation of how fast they are, on average"),
        bent_field("predicted_gap_error", GAP_M, "m", (), "the filter's prediction"),
        bent_field("predicted_speed", SPEED_MPS, "m/s", (), "the filter's prediction"),
        bent_field("command_behind", COMMAND_MPS2, "m/s2", (), "the last command of the vehicle behind the gap"),
        bent_field("command_ahead", COMMAND_MPS2, "m/s2", (), "that of the vehicle ahead; 0 for the lead's gap"),
        Field("range_used", "-", 0, 1, (), "1 where the own range was used in the last step"),
        Field("rate_used", "-", 0, 1, (), "1 where the own range-rate was used in the last step"),
        Field("rear", "-", 0, 1, (), "1 for a rear sensor"),
        Field("alone", "-", 0, 1, (), "1 where no other sensor measures the gap"),
        Field("gap", "-", 0, n - 1, (), "which gap, by the vehicle behind it"),
        Field("gain", "-", 0.5, 1.5, (2 if config.gain_spread > 0 else 0,), "k_p and k_d, as parts of the configured"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
    )


@kernel
def _observe(sight: Sight, observation: Observation, shown: Observation) -> None:
    """Fill (B, A, m) from the role's observation (B, size)."""
    values, z = room(shown.shape[2]), room(2 * sight.gaps.size)
    for b in range(shown.shape[0]):
        seen, rows = borrowed(observation)[b], borrowed(shown)[b]
        _normalise(sight, seen, borrowed(z))
        for agent in range(rows.shape[0]):
            _fill(sight, seen, z, agent, borrowed(values))
            encode_row(borrowed(values), borrowed(sight.own_scale), rows[agent])


@inlined
def _normalise(sight: Sight, seen: Observation, z: FloatArray) -> None:
    """Innovations (R,) in standard deviations: ranges, then range-rates."""
    at, half = sight.offsets[0], sight.gaps.size
    for j in range(half):
        ranges = decode_entry(seen, sight.scale, at.range_innovation + j) / decode_entry(
            seen, sight.scale, at.range_deviation + j
        )
        rates = decode_entry(seen, sight.scale, at.rate_innovation + j) / decode_entry(
            seen, sight.scale, at.rate_deviation + j
        )
        z[j], z[half + j] = ranges, rates


@inlined
def _fill(sight: Sight, seen: Observation, z: FloatArray, agent: int, row: FloatArray) -> None:
    """The values (m,) of one agent."""
    at, to, half = sight.offsets[0], sight.own_offsets[0], sight.gaps.size
    gap, partner, n = sight.gaps[agent], sight.partners[agent], (half + 1) // 2
    row[to.range_z], row[to.rate_z] = z[agent], z[half + agent]
    row[to.range_z2], row[to.rate_z2] = z[agent] * z[agent], z[half + agent] * z[half + agent]
    row[to.partner_range_z] = z[partner] if partner >= 0 else 0.0
    row[to.partner_rate_z] = z[half + partner] if partner >= 0 else 0.0
    row[to.worst_range_z], row[to.worst_rate_z] = _largest(z[:half]), _largest(z[half:])
    row[to.ahead_rate_z] = _mean(sight, z[half:], gap + 1) if gap < n - 1 else 0.0
    row[to.behind_rate_z] = _mean(sight, z[half:], gap - 1) if gap > 0 else 0.0
    row[to.platoon_range_z], row[to.platoon_rate_z] = _platoon(sight, z[:half], n), _platoon(sight, z[half:], n)
    row[to.predicted_gap_error] = bent(decode_entry(seen, sight.scale, at.predicted_gap_error + gap), GAP_M)
    row[to.predicted_speed] = bent(decode_entry(seen, sight.scale, at.predicted_speed + gap), SPEED_MPS)
    row[to.command_behind] = bent(decode_entry(seen, sight.scale, at.command + gap), COMMAND_MPS2)
    ahead = decode_entry(seen, sight.scale, at.command + gap + 1) if gap < n - 1 else 0.0
    row[to.command_ahead] = bent(ahead, COMMAND_MPS2)
    row[to.range_used] = decode_entry(seen, sight.scale, at.trust + agent)
    row[to.rate_used] = decode_entry(seen, sight.scale, at.trust + half + agent)
    row[to.rear] = 1.0 if agent >= n else 0.0
    row[to.alone] = 1.0 if partner < 0 else 0.0
    row[to.gap] = gap
    for k in range(to.steps_left - to.gain):
        row[to.gain + k] = decode_entry(seen, sight.scale, at.gain + k)
    row[to.steps_left] = decode_entry(seen, sight.scale, at.steps_left)


@inlined
def _mean(sight: Sight, z: FloatArray, gap: int) -> float:
    """The mean of the innovations (A,) of a gap's sensors."""
    total, count = 0.0, 0
    for agent in range(z.size):
        if sight.gaps[agent] == gap:
            total += z[agent]
            count += 1
    return total / count


@inlined
def _platoon(sight: Sight, z: FloatArray, n: int) -> float:
    """What all gaps say of the vehicles' mean place or speed: a gap counts once for each vehicle behind it.

    Disturbances of single vehicles hardly show in it, and a lie about the lead's gap, which nobody checks, shows most.
    """
    total, square = 0.0, 0.0
    for gap in range(n):
        total -= (gap + 1) * _mean(sight, z, gap)
        square += (gap + 1) * (gap + 1)
    return total / math.sqrt(square)


@inlined
def _largest(values: FloatArray) -> float:
    """The largest size of the values (k,)."""
    found = 0.0
    for i in range(values.size):
        found = max(found, abs(values[i]))
    return found
