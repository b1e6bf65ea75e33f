"""The defenders of chapter 5 that never change their mind: every vehicle keeps one controller."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.inside import Alone, InsidePolicy, begin_blank, take_known
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from cps_envs.rogue.actions import PLAIN
from cps_envs.rogue.controllers import CONTROLLERS


class HeldController(AnalyticPolicy):
    """Every vehicle drives by one of `cps_envs.rogue.controllers.CONTROLLERS` and keeps its separation.

    Raises:
        ConfigurationError: the environment takes accelerations, not controllers; or there is no such controller.
    """

    def __init__(self, spec: RoleSpec, controller: str = "linear") -> None:
        super().__init__(spec)
        require_modes(spec, self)
        if controller not in CONTROLLERS:
            raise ConfigurationError(f"controller = {controller!r} is not one of {', '.join(CONTROLLERS)}")
        self.action = np.tile([CONTROLLERS.index(controller), PLAIN], spec.config.num_orders)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The same action for every episode."""
        return repeat(self.action, len(seen)), state

    def inside(self) -> InsidePolicy:
        """The same."""
        known = Alone(self.action)
        return InsidePolicy(known, lambda _: Alone(np.zeros(1)), begin_blank, take_known)


def require_modes(spec: RoleSpec, policy: AnalyticPolicy) -> None:
    """Refuse environments whose defender commands accelerations.

    Raises:
        ConfigurationError: this is one.
    """
    if spec.config.defense_action == "command":
        raise ConfigurationError(f'{type(policy).__name__} selects controllers; it needs defense_action="mode"')


def pd(spec: RoleSpec) -> HeldController:
    """Plays the linear bidirectional controller (5.15), as in Fig. 5.6."""
    return HeldController(spec, "linear")


def sliding(spec: RoleSpec) -> HeldController:
    """Plays the sliding mode (5.9) to (5.11) without detection, as in Fig. 5.7."""
    return HeldController(spec, "sliding")


def sliding_detection(spec: RoleSpec) -> HeldController:
    """Plays the sliding mode with detection, as in Fig. 5.8: a vehicle that detects the attacker follows it."""
    return HeldController(spec, "detecting")
