"""The paper's decentralised mitigation as a policy: Algorithm 1 on what the defender observes, once per decision."""

from __future__ import annotations

from cps_baselines.disbanding.corrections import Corrections, Layout, Sight, look, sight_for
from cps_baselines.disbanding.heuristic import FORESIGHT, Foresight, travelled_distance_command
from cps_envs.core.config import is_multiple
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import borrowed, clip, inlined, kernel, lend, pack, unpack
from cps_envs.core.policy import RoleSpec
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.start import nominal_constants
from cps_envs.disbanding.state import Constants


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
