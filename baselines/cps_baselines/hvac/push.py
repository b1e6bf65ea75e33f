"""Attacks beside those on readings: what is pushed, what is hidden behind sensors, and what does not arrive."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.replacing import attack_age
from cps_baselines.hvac.stealthy import Stealthy, loss_response
from cps_envs.core.declare.config import of_bodies
from cps_envs.core.declare.objective import weights_of
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, State
from cps_envs.hvac.attack import bias_action, with_powers
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.powers import ABSENT, powers_of
from cps_envs.hvac.sensors import zones_of_sensors

PAID, WARMER, COLDER, AWAY, COMFORT = DIRECTIONS = ("paid", "warmer", "colder", "away", "comfort")
BEYOND_C = 0.3  # by which zones are pushed out of comfort, before it lets go


@plays_in("learning with command_attack_w=300")
class Push(AnalyticPolicy):
    """Adds to all commands and shifts all set-points, by a `share` of what it can.

    `direction` says which way: `warmer`; `colder`, which shuts the heating down where the reach is long enough; `away`
    from the set-point, where each zone is already; or `comfort`, the same for as long as the zone is still comfortable.
    `paid` takes the one that pays: warmer for energy and for impact, colder where energy costs, comfort for hours out
    of it.

    Raises:
        ConfigurationError: no power over commands or set-points, a direction that is none, a share outside (0, 1], or a
            direction that depends on temperatures which the attacker does not see.
    """

    def __init__(self, spec: RoleSpec, *, direction: str = PAID, share: float = 1.0) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        powers = powers_of(self.config)
        held = {"commands": powers.commands_at, "references": powers.references_at}
        self._held = [name for name, at in held.items() if at != ABSENT]
        if not self._held:
            raise ConfigurationError(
                "push changes commands and set-points: set command_attack_w=300, or reference_attack_c"
            )
        if direction not in DIRECTIONS:
            raise ConfigurationError(
                f"direction = {direction!r} is not one of {', '.join(DIRECTIONS)}. {near(direction, DIRECTIONS)}"
            )
        if not 0 < share <= 1:
            raise ConfigurationError(f"share = {share}: give a share of the attacker's reach, above 0 and at most 1")
        self.direction, self.share = paid_direction(self.config) if direction == PAID else direction, share
        if self.direction in (AWAY, COMFORT) and self.config.attacker_view != "white":
            raise ConfigurationError(
                f'direction = {self.direction!r} follows true temperatures: set attacker_view="white", or name another'
            )

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, entries)."""
        action = bias_action(self.config, np.zeros((len(seen), 1)), keep_noise=True)
        return with_powers(self.config, action, **dict.fromkeys(self._held, self.share * self._ways(seen))), state

    def _ways(self, seen: Seen) -> FloatArray:
        """-1 for colder, 1 for warmer, 0 to let go, (B, n) or (1, 1)."""
        if self.direction in (WARMER, COLDER):
            return np.array([[1.0 if self.direction == WARMER else -1.0]])
        wanted = seen["reference_c"] if seen["reference_c"].shape[1] else np.asarray(self.config.reference_c)
        error_c = seen["temperature"] - wanted
        out = (np.abs(error_c) > self.config.comfort_c + BEYOND_C) & (self.direction == COMFORT)
        return np.where(out, 0.0, np.where(error_c < 0, -1.0, 1.0))


def paid_direction(config: HvacConfig) -> str:
    """Which way of `Push` pays by the `payoff` of a configuration; of a function it knows nothing, as of impact."""
    weights = weights_of(config)
    paid = dict(weights) if isinstance(weights, tuple) else {}
    energy = paid.get("energy_kwh", 0.0) + paid.get("attack_kwh", 0.0)
    if energy < 0:
        return COLDER
    only_comfort = paid.get("discomfort_h", 0.0) > 0 and energy == paid.get("a_impact", 0.0) == 0
    return COMFORT if only_comfort else WARMER


@plays_in("learning with command_attack_w=300")
class Covert(Stealthy):
    """Adds to all commands, and takes what this does to the house out of the readings of compromised sensors.

    With every sensor compromised no defender can tell: all readings are those of a house without an attack. b(k + 1) =
    A b(k) + B a, a being `share` of `command_attack_w`. With `warmer=False` it takes heat away.

    Raises:
        ConfigurationError: no power over commands, or a share outside (0, 1].
    """

    def __init__(self, spec: RoleSpec, *, share: float = 1.0, warmer: bool = True) -> None:
        super().__init__(spec, keep_noise=True, warmer=not warmer)
        if powers_of(self.config).commands_at == ABSENT:
            raise ConfigurationError("covert hides what it adds to commands: set command_attack_w=300, for example")
        if not 0 < share <= 1:
            raise ConfigurationError(f"share = {share}: give a share of the attacker's reach, above 0 and at most 1")
        self._commands = share if warmer else -share
        heat_w = share * of_bodies(self.config.command_attack_w, self.config.num_zones)
        self._bias_c = loss_response(self.config, heat_w)[:, zones_of_sensors(self.config)]

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, entries)."""
        action, state = super().act(seen, state)
        return with_powers(self.config, action, commands=self._commands), state

    def bias_c(self, seen: Seen, age: IntArray, state: State | None) -> FloatArray:
        """How much warmer each sensor's zone became."""
        bias: FloatArray = self._bias_c[age]
        return bias


@plays_in('learning with denial=["readings", "commands"]')
class Jam(AnalyticPolicy):
    """Lets no readings or commands arrive: for `hold_h` hours, then for a step it does, and so on.

    A controller that is not heard goes on integrating. What it asks for when it is heard again is held for the next
    `hold_h` hours.

    Raises:
        ConfigurationError: nothing can be denied, or a time that is not positive.
    """

    def __init__(self, spec: RoleSpec, *, hold_h: float = 2.0) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if not self.config.denial:
            raise ConfigurationError('jam keeps messages from arriving: set denial=["readings", "commands"]')
        if not hold_h > 0:
            raise ConfigurationError(f"hold_h = {hold_h}: messages are held for a positive time")
        self.hold_steps = max(1, round(3600.0 * hold_h / self.config.step_s))
        self._held = [f"deny_{word}" for word in self.config.denial]

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, entries)."""
        action = bias_action(self.config, np.zeros((len(seen), 1)), keep_noise=True)
        denied = (attack_age(seen, self.config) % (self.hold_steps + 1) != 0)[:, np.newaxis]
        return with_powers(self.config, action, **dict.fromkeys(self._held, denied.astype(np.float64))), state
