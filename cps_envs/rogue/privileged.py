"""What an episode hides, as numbers of about unit size: for a learner's value function, in training only."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.fields import compressed
from cps_envs.rogue.state import NEVER, State

FEW_MPS = 10.0  # chosen: what counts as 1, of the damage so far
SURPLUS = 0.2  # chosen: the power ratio beyond 1 that counts as 1


class Truth:
    """The true course of the episodes of a game; it looks at the game's own state and draws."""

    def __init__(self, config: RogueConfig, state: State, drawn: Array) -> None:
        self._config, self._state, self._drawn = config, state, drawn

    @property
    def seat(self) -> IntArray:
        """The seized vehicle (B,), 0 = rear."""
        seats: IntArray = self._drawn["attacker"]
        return seats

    @property
    def rogue(self) -> BoolArray:
        """The seized vehicles, (B, n)."""
        seized: BoolArray = self._state.rogue
        return seized

    @property
    def seats(self) -> IntArray:
        """The same as numbers (B, k), 0 = rear; before the first reset the first k."""
        found: IntArray = np.argsort(~self.rogue, axis=1, kind="stable")[:, : self._config.num_seized]
        return np.sort(found, axis=1)

    def attacked(self) -> BoolArray:
        """Where the attacker drives, (B,)."""
        begun: BoolArray = self._state.step >= self._drawn["onset_step"]
        return begun

    def there(self) -> BoolArray:
        """The vehicles (B, n) that a platoon has."""
        present: BoolArray = np.arange(self._config.max_vehicles) < self._drawn["num_vehicles"][:, np.newaxis]
        return present

    def attacker(self) -> Observation:
        """What the attacker is not told, (B, 16), of each of k seized vehicles (B, 16 k), see `seized`."""
        told = self.seized()
        return told.reshape(len(told), -1)

    def seized(self) -> Observation:
        """Of each seized vehicle exact gaps and rates, its neighbours' controllers, and `_paid`: (B, k, 16)."""
        there, ends = self.there()[:, 1:], ((0, 0), (1, 1))  # beyond which nobody is
        gap, rate = (np.pad(np.where(there, each, 0.0), ends) for each in self._gaps())
        rows, seats = np.arange(len(self.seat))[:, np.newaxis], self.seats
        sides = (gap[rows, seats + 1], rate[rows, seats + 1], gap[rows, seats], rate[rows, seats])
        beside = np.stack([np.minimum(seats + 1, self._config.max_vehicles - 1), np.maximum(seats - 1, 0)], axis=-1)
        laws = self._state.controller[rows[..., np.newaxis], beside]
        kinds = (laws[..., np.newaxis] == np.arange(len(DRIVEN))).reshape(*seats.shape, -1)
        paid = np.broadcast_to(np.stack(self._paid(), axis=1)[:, np.newaxis], (*seats.shape, 2))
        own = np.stack([side / 4 for side in sides], axis=-1)
        return np.concatenate([own, kinds, paid], axis=-1, dtype=np.float32)

    def defender(self) -> Observation:
        """What the defender is not told, (B, 9): `_episode` and the seat."""
        return np.column_stack([*self._episode(), self.seat / self._config.max_vehicles]).astype(np.float32)

    def vehicles(self) -> Observation:
        """The same for each vehicle, (B, n, 13): `_episode`, how far from its place, and from the next seized one."""
        shared = np.stack(self._episode(), axis=1)
        apart = np.arange(self._config.max_vehicles)[:, np.newaxis] - self.seats[:, np.newaxis]
        away = np.take_along_axis(apart, np.abs(apart).argmin(axis=2, keepdims=True), axis=2)[..., 0]
        own = np.stack([compressed(self._errors()) / 4, away / 4, away == 0, away == -1, away == 1], axis=-1)
        everywhere = np.broadcast_to(shared[:, np.newaxis], (*away.shape, shared.shape[1]))
        return np.concatenate([everywhere, own], axis=-1, dtype=np.float32)

    def _episode(self) -> tuple[FloatArray, ...]:
        """Whether the attacker drives, or ever will; its power; the size; the least and mean gap; `_paid`."""
        drawn, gap = self._drawn, self._gaps()[0]
        pairs = self.there()[:, 1:]
        count = pairs.sum(axis=1)
        fewest = np.maximum(count, 1)  # before the first reset nobody is there
        surplus = (drawn["attacker_drive_mps2"] / drawn["drive_mps2"] - 1) / SURPLUS
        least, mean = np.where(pairs, gap, np.inf).min(axis=1), np.where(pairs, np.abs(gap), 0.0).sum(axis=1) / fewest
        known = self.attacked(), drawn["onset_step"] < NEVER, surplus, count / self._config.max_vehicles
        return *(np.asarray(each, np.float64) for each in known), least / 4, mean / 4, *self._paid()

    def _gaps(self) -> tuple[FloatArray, FloatArray]:
        """Gap errors and rates (B, n - 1) of all pairs, compressed."""
        position, speed = self._state.position, self._state.speed
        return compressed(np.diff(position) - self._config.separation_m), compressed(np.diff(speed))

    def _paid(self) -> tuple[FloatArray, FloatArray]:
        """The damage so far, and how far the vehicles are from their places, for which is paid at every moment."""
        away = np.where(self.there(), np.abs(self._errors()), 0.0).sum(axis=1) / self._drawn["num_vehicles"]
        return np.log1p(self._state.damage.sum(axis=1) / FEW_MPS), np.log1p(away / self._config.separation_m)

    def _errors(self) -> FloatArray:
        """How far each vehicle is behind its place (B, n) in m, see `formation.place`."""
        drawn, position, count = self._drawn, self._state.position, self._drawn["num_vehicles"]
        reference = drawn["reference_start_m"] + drawn["reference_speed_mps"] * self._state.step * self._config.dt_s
        vehicles = np.arange(position.shape[1])
        places = reference[:, np.newaxis] - (count[:, np.newaxis] - 1 - vehicles) * self._config.separation_m
        if self._config.formation_cost == "open_place":
            attacked, rows = self.attacked()[:, np.newaxis], np.arange(len(position))[:, np.newaxis]
            for seat in np.split(self.seats, self._config.num_seized, axis=1):
                beside = position[rows, seat] + (vehicles - seat) * self._config.separation_m
                open_places = np.where(vehicles < seat, np.minimum(places, beside), np.maximum(places, beside))
                places = np.where(attacked, open_places, places)
        errors: FloatArray = places - position
        return errors
