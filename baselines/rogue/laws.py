"""The defenders of chapter 5 that never change their mind: every intact vehicle keeps one law."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State, repeat
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array
from cps_envs.rogue.actions import PLAIN
from cps_envs.rogue.controllers import CONTROLLERS


class HeldLaw(AnalyticPolicy):
    """Every intact vehicle drives by one law, named in `cps_envs.rogue.laws.CONTROLLERS`, and keeps its separation.

    Raises:
        ConfigurationError: the environment takes accelerations, not laws; or there is no such law.
    """

    def __init__(self, spec: RoleSpec, law: str = "linear") -> None:
        super().__init__(spec)
        require_laws(spec, self)
        if law not in CONTROLLERS:
            raise ConfigurationError(f"law = {law!r} is not one of {', '.join(CONTROLLERS)}")
        self.action = np.tile([CONTROLLERS.index(law), PLAIN], spec.config.num_intact)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The same action for every episode."""
        return repeat(self.action, len(seen)), state


def require_laws(spec: RoleSpec, policy: AnalyticPolicy) -> None:
    """Refuse environments whose defender commands accelerations.

    Raises:
        ConfigurationError: this is one.
    """
    if spec.config.defense_action != "mode":
        raise ConfigurationError(f'{type(policy).__name__} selects laws; it needs defense_action="mode"')


def pd(spec: RoleSpec) -> HeldLaw:
    """The linear bidirectional controller (5.15) of Fig. 5.6."""
    return HeldLaw(spec, "linear")


def sliding(spec: RoleSpec) -> HeldLaw:
    """The sliding mode (5.9) to (5.11) without detection of Fig. 5.7."""
    return HeldLaw(spec, "sliding")


def sliding_detection(spec: RoleSpec) -> HeldLaw:
    """The sliding mode with detection of Fig. 5.8: whoever detects the attacker follows it."""
    return HeldLaw(spec, "detecting")
