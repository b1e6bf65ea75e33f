"""The decentralised defence: one agent for each vehicle that gets orders, with its own sensors and controller."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.objective import is_own
from cps_envs.core.policies.team import Team, shared_alike
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.fields import vehicle_fields
from cps_envs.rogue.observation import observe_vehicles
from cps_envs.rogue.privileged import Truth
from cps_envs.rogue.state import State


def names_of(config: RogueConfig) -> tuple[str, ...]:
    """`intact_1` (rear) to `intact_{n-1}` (leader), without the seized vehicles.

    With `orders="all"` `vehicle_1` to `vehicle_n`, with the seized one and those that an episode lacks.
    """
    name = "vehicle" if config.hidden else "intact"
    return tuple(f"{name}_{k + 1}" for k in range(config.num_orders))


def seized_names(config: RogueConfig) -> tuple[str, ...]:
    """`seized_2` and so on, by the seats of vehicles that attack together, 1 = rear; `attacker` where there is one."""
    return tuple(f"seized_{seat}" for seat in config.attacker_indices) or ("attacker",)


class SeizedTeam(Team):
    """The agents of `seized_names`. They are one attacker, and share what it is paid alike."""

    def __init__(self, config: RogueConfig, state: State, drawn: Array) -> None:
        self.agents, self._truth = seized_names(config), Truth(config, state, drawn)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, A), equal parts of the payoff (B,)."""
        return -shared_alike(payoff, len(self.agents))

    def privileged(self) -> Observation:
        """What the attacker is not told, (B, A, p), see `privileged.Truth.seized`."""
        return self._truth.seized()


class VehicleTeam(Team):
    """The agents of `names_of`. They look at the state, the drawn quantities and the rules of a game.

    `episodes` (B,) is the game's own count of the episodes that have begun.
    """

    def __init__(self, config: RogueConfig, state: State, drawn: Array, rules: Array, episodes: IntArray) -> None:
        self._config, self._seen = config, (state, drawn, rules)
        self._truth, self._drawn = Truth(config, state, drawn), drawn
        self._damage, self._charged = state.damage, state.damage.copy()
        self._episodes, self._charged_in = episodes, episodes.copy()
        self.agents = names_of(config)
        self._fields = vehicle_fields(config)

    def observe(self) -> Observation:
        """Own rows (B, k, size), see `fields.vehicle_fields`."""
        encoded = np.empty((len(self._drawn), len(self.agents), self._fields.size), np.float32)
        observe_vehicles(*self._seen, self._fields.offsets, self._fields.scale, encoded)
        return encoded

    def privileged(self) -> Observation:
        """What the vehicles are not told, (B, k, p), see `privileged.Truth.vehicles`."""
        return self._ordered(self._truth.vehicles())

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, k) since the last call in this episode, which sum to minus the payoff (B,) since then.

        The damage of a pair is charged to its two vehicles in equal parts, and what is left, the formation charge, to
        all that the platoon has. What would fall to a seized vehicle, once it is driven, falls to the others. Another
        `payoff` is shared alike.
        """
        if not is_own(self._config):
            return shared_alike(payoff, len(self.agents))
        same = (self._episodes == self._charged_in)[:, np.newaxis]
        damage = self._damage - np.where(same, self._charged, 0.0)
        self._charged, self._charged_in = self._damage.copy(), self._episodes.copy()
        driven = self._truth.there()
        seized = np.ones(len(payoff), np.bool_) if not self._config.hidden else self._truth.attacked()
        driven &= ~(self._truth.rogue & seized[:, np.newaxis])
        rear, front = 0.5 + 0.5 * (~driven[:, 1:]), 0.5 + 0.5 * (~driven[:, :-1])
        charge = np.zeros(driven.shape)
        charge[:, :-1] += damage * rear * driven[:, :-1]
        charge[:, 1:] += damage * front * driven[:, 1:]
        charge += driven * ((payoff - damage.sum(axis=1)) / driven.sum(axis=1))[:, np.newaxis]
        return -self._ordered(charge)

    def _ordered(self, vehicles: Array) -> Array:
        """The rows (B, k, ...) of those that get orders, from those of all vehicles (B, n, ...)."""
        if self._config.hidden:
            return vehicles
        rest: Array = vehicles[~self._truth.rogue].reshape(len(vehicles), -1, *vehicles.shape[2:])
        return rest
