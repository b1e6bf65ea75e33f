"""Numbers of a configuration that fit another platoon."""

from __future__ import annotations

from itertools import product

from cps_envs.core.declare.foreign import too_late
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.model import platoon_model


def foreign(config: FdiConfig) -> list[str]:
    """A sentence for each kind of number that does not fit."""
    found = [too_late(config, "onset_s", config.horizon * config.dt_s, "horizon"), _drawn_gains(config)]
    return [each for each in found if each]


def _drawn_gains(config: FdiConfig) -> str:
    """Gains that are drawn so far apart that the platoon is unstable; those in the middle have been checked."""
    shares = (1.0 - config.gain_spread, 1.0 + config.gain_spread)
    gains = set(product(shares, shares))
    radii = [
        platoon_model(
            config.num_vehicles,
            config.proportional_gain * p,
            config.derivative_gain * d,
            config.dt_s,
            config.discretisation,
        ).spectral_radius
        for p, d in sorted(gains)
    ]
    if max(radii) < 1.0:
        return ""
    return (
        f"gain_spread = {config.gain_spread} draws gains with which the platoon is unstable without any attack, "
        f"with dt_s = {config.dt_s}: lower one of them"
    )
