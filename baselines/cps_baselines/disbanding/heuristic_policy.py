"""The travelled-distance heuristic, Algorithm 1: brake when you would cover more distance than the vehicle ahead.

The law, and the paper's decentralised mitigation as a policy: the law on what the defender observes, once per decision.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cps_baselines.disbanding.corrections import Corrections, Layout, Sight, look, sight_for
from cps_envs.core.compute.kernels import borrowed, clip, inlined, kernel, lend, pack, unpack
from cps_envs.core.declare.config import is_multiple
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.start import nominal_constants
from cps_envs.disbanding.state import Constants


class Foresight(NamedTuple):
    """How far and how finely the heuristic looks ahead; the defaults are chosen, as the paper prints none."""

    num_samples: int = 5  # t_s / Delta t_s; t_s from 0.5 to 2 s gives similar errors
    sample_s: float = 0.1  # Delta t_s
    decrement_mps2: float = 0.1  # Delta a
    clearance_m: float = 0.0  # a command is safe while the predicted gaps stay above this


FORESIGHT = Foresight()


@inlined
def travelled_distance_command(
    law_command: float,
    command_ahead: float,
    gap: float,
    speed: float,
    speed_ahead: float,
    c: Constants,
    foresight: Foresight,
) -> float:
    """The command (m/s2) of one mitigable vehicle whose gap is shrinking, before collision avoidance.

    `law_command` is the raw command of its own law, returned unchanged where the heuristic sees no need to act;
    `command_ahead` is the predecessor's final command of this step, `gap` (m) and the speeds (m/s) are measured now.
    Equations (2.12) to (2.14), with (t_end - t_1)^2 in (2.14) and the search for a safe command going downward.
    """
    low, high, slowest, fastest = c.min_acceleration_mps2, c.max_acceleration_mps2, c.min_speed_mps, c.max_speed_mps
    ahead = clip(command_ahead, low, high)
    distance_ahead = travelled_distance(speed_ahead, ahead, slowest, fastest, foresight)
    if distance_ahead >= travelled_distance(speed, clip(law_command, low, high), slowest, fastest, foresight):
        return law_command
    horizon_s = foresight.num_samples * foresight.sample_s
    command = clip((distance_ahead - speed * horizon_s) / (0.5 * horizon_s * horizon_s), low, high)
    while command > low and overlaps(gap, speed, command, speed_ahead, ahead, slowest, fastest, foresight):
        command = next_below(command, low, foresight.decrement_mps2)
    return command


@inlined
def travelled_distance(speed: float, command: float, slowest: float, fastest: float, foresight: Foresight) -> float:
    """Distance (m) covered within the horizon under a constant command (m/s2), by (2.13) with limited speed."""
    distance, sample_s = 0.0, foresight.sample_s
    for _ in range(foresight.num_samples):
        distance += sample_s * speed
        speed = clip(speed + sample_s * command, slowest, fastest)
    return distance


@inlined
def overlaps(
    gap: float,
    speed: float,
    command: float,
    speed_ahead: float,
    command_ahead: float,
    slowest: float,
    fastest: float,
    foresight: Foresight,
) -> bool:
    """Whether the predicted gap (m) does not stay above the clearance at some sample of the horizon."""
    sample_s = foresight.sample_s
    for _ in range(foresight.num_samples):
        gap += sample_s * (speed_ahead - speed)
        if gap <= foresight.clearance_m:
            return True
        speed = clip(speed + sample_s * command, slowest, fastest)
        speed_ahead = clip(speed_ahead + sample_s * command_ahead, slowest, fastest)
    return False


@inlined
def next_below(command: float, low: float, decrement: float) -> float:
    """The largest value low + i * decrement smaller than `command` (m/s2), not below `low`.

    A value within a billionth of the grid counts as lying on it, so that the search always goes down.
    """
    return low + max(math.ceil((command - low) / decrement - 1e-9) - 1, 0) * decrement


class HeuristicMitigation(Corrections):
    """Brakes each vehicle that would travel farther than the one ahead (Algorithm 1), from front to rear.

    A vehicle returns to its own law as soon as the one ahead is not slower. The correction is held for the control
    period: 0.1 s costs 0.1 to 4 points against a decision at every integration step, `control_period_s=0.01`.

    `avoidance=False` tells it that collision avoidance does not act on the vehicles that it corrects.

    Raises:
        ConfigurationError: samples that do not divide the horizon, or a decrement that leads nowhere.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        horizon_s: float = FORESIGHT.num_samples * FORESIGHT.sample_s,
        sample_s: float = FORESIGHT.sample_s,
        decrement_mps2: float = FORESIGHT.decrement_mps2,
        clearance_m: float = FORESIGHT.clearance_m,
        avoidance: bool = True,
        **detection: float,
    ) -> None:
        super().__init__(spec, **detection)
        if not (sample_s > 0 and is_multiple(horizon_s, sample_s)):
            raise ConfigurationError(f"horizon_s = {horizon_s} has to be a multiple of sample_s = {sample_s}.")
        if not decrement_mps2 > 0:
            raise ConfigurationError(f"decrement_mps2 = {decrement_mps2} has to be above 0.")
        self._foresight = Foresight(
            round(horizon_s / sample_s), float(sample_s), float(decrement_mps2), float(clearance_m)
        )
        self._constants = pack(nominal_constants(spec.config))
        self._avoidance = avoidance

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        known = (self._constants, self._foresight, self._avoidance)
        _sweep(seen.observation, self.layout, reasons, *known, corrections)


@kernel
def _sweep(
    observation: Observation,
    layout: Layout,
    reasons: BoolArray,
    constants: Array,
    foresight: Foresight,
    avoidance: bool,
    corrections: FloatArray,
) -> None:
    c, sight = unpack(Constants, constants, 0), sight_for(corrections.shape[1])
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), borrowed(reasons)[b], sight)
        sweep_row(sight, c, foresight, avoidance, borrowed(corrections)[b])


@inlined
def sweep_row(sight: Sight, c: Constants, foresight: Foresight, avoidance: bool, corrections: FloatArray) -> None:
    """Fill the corrections (M,) in m/s2 of one episode's mitigable vehicles."""
    ahead = sight.law_command[0]  # final command of the predecessor
    for q in range(1, corrections.size):
        law, own, before, space = sight.law_command[q], sight.speed[q], sight.speed[q - 1], sight.gap[q]
        if sight.mitigable[q] and sight.relative_speed[q] < 0.0:
            command = travelled_distance_command(law, ahead, space, own, before, c, foresight)
            corrections[q] = clip(command, c.min_acceleration_mps2, c.max_acceleration_mps2) - law
        ahead = law + corrections[q]
        if avoidance or not sight.mitigable[q]:
            ahead = final_command(ahead, space, own, before, c)
