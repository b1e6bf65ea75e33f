"""The attacker of section 5.2.3: it keeps to the linear law (5.15) but changes the gains, so that the platoon sways."""

from __future__ import annotations

from cps_baselines.rogue.strike import NEVER_AGAIN, Pattern, Striking
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec


class ChangedGains(Striking):
    """Drives by the linear law (5.15), but with its own gains. By default they feed every oscillation.

    Without options only the sign of k_d is reversed: every oscillation is fed and not damped. An attack begins in the
    steady state, where any gains ask for nothing, so the attacker first drives at full effort for `kick_s`. The
    dissertation names the idea and no gains; these were chosen.

    Raises:
        ConfigurationError: a kick of negative duration.
    """

    def __init__(
        self, spec: RoleSpec, proportional: float = 1.0, derivative: float = -3.0, kick_s: float = 1.0
    ) -> None:
        if kick_s < 0:
            raise ConfigurationError(f"kick_s = {kick_s} has to be at least 0")
        super().__init__(spec, Pattern(kick_s, NEVER_AGAIN, spec.config.max_effort, proportional, derivative))
