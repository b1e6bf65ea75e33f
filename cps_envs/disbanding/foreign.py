"""Numbers of a configuration that fit the vehicles of Table 2.1 and are used for others."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from cps_envs.core.compute.discretisation import zero_order_hold
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.foreign import other_fields, too_late
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import PRESETS, DisbandingConfig

STRING = (
    *("vehicles_per_platoon", "tau_s", "headway_s", "proportional_gain", "derivative_gain"),
    *("interpretation", "dt_s"),
)


@lru_cache(maxsize=64)
def foreign(config: DisbandingConfig) -> tuple[str, ...]:
    """A sentence for each kind of number that is of other vehicles."""
    found = [too_late(config, "earliest_attack_s", config.duration_s, "duration_s")]
    if other_fields(config, PRESETS, STRING) and sways(config):
        found.append(
            f"proportional_gain = {config.proportional_gain} and derivative_gain = {config.derivative_gain} let an "
            f"intact platoon sway without any attack, with tau_s = {config.tau_s} and steps of "
            f"{config.dynamics.dt_s} s: change them"
        )
    return tuple(each for each in found if each)


def sways(config: DisbandingConfig) -> bool:
    """Whether an intact platoon behind a vehicle of constant speed is unstable, at some corner of what is drawn."""
    corners = product(bounds(config.tau_s), bounds(config.proportional_gain), bounds(config.derivative_gain))
    return any(spectral_radius(config, *each) >= 1.0 for each in set(corners))


def spectral_radius(config: DisbandingConfig, tau_s: float, k_p: float, k_d: float) -> float:
    """Of a platoon in integration steps, by (2.1) to (2.4) without limits."""
    n, dt_s = config.vehicles_per_platoon, config.dynamics.dt_s
    forward, own = np.eye(n), np.eye(n, k=-1) - np.eye(n)  # gap of each: the one ahead less its own place
    shared: FloatArray = own - np.eye(n, k=1) @ own  # less the gap behind, but of the leader and the last
    shared[0] = own[0]
    places, speeds = k_p * shared, k_d * shared
    speeds[0, 0] -= k_p * config.headway_s
    zero, lag = np.zeros((n, n)), forward / tau_s
    free = np.block([[zero, forward, zero], [zero, zero, forward], [zero, zero, -lag]])
    command, feedback = np.vstack([zero, zero, lag]), np.hstack([places, speeds, zero])
    if config.dynamics.exact_integration:
        moved, driven = zero_order_hold(free, command, dt_s)
    else:
        moved, driven = np.eye(3 * n) + dt_s * free, dt_s * command
    return float(np.abs(np.linalg.eigvals(moved + driven @ feedback)).max())
