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

    def attacked(self) -> BoolArray:
        """Where the attacker drives, (B,)."""
        begun: BoolArray = self._state.step >= self._drawn["onset_step"]
        return begun

    def there(self) -> BoolArray:
        """The vehicles (B, n) that a platoon has."""
        present: BoolArray = np.arange(self._config.max_vehicles) < self._drawn["num_vehicles"][:, np.newaxis]
        return present

    def attacker(self) -> Observation:
        """What the attacker is not told, (B, 16): exact gaps and rates, its neighbours' controllers, `_paid`."""
        gap, rate = self._gaps()
        rows, seats = np.arange(len(self.seat)), self.seat
        behind = np.maximum(seats - 1, 0)
        followed = np.where(seats > 0, 1.0, 0.0)
        sides = (gap[rows, seats], rate[rows, seats], followed * gap[rows, behind], followed * rate[rows, behind])
        laws = self._state.controller[rows[:, np.newaxis], np.stack([seats + 1, behind], axis=1)]
        kinds = (laws[..., np.newaxis] == np.arange(len(DRIVEN))).reshape(len(rows), -1)
        return np.column_stack([*(side / 4 for side in sides), kinds, *self._paid()]).astype(np.float32)

    def defender(self) -> Observation:
        """What the defender is not told, (B, 9): `_episode` and the seat."""
        return np.column_stack([*self._episode(), self.seat / self._config.max_vehicles]).astype(np.float32)

    def vehicles(self) -> Observation:
        """The same for each vehicle, (B, n, 13): `_episode`, how far it is from its place, and from the seized one."""
        shared = np.stack(self._episode(), axis=1)
        away = np.arange(self._config.max_vehicles) - self.seat[:, np.newaxis]
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
            rows, seat = np.arange(len(position)), self.seat[:, np.newaxis]
            beside = position[rows, self.seat][:, np.newaxis] + (vehicles - seat) * self._config.separation_m
            open_places = np.where(vehicles < seat, np.minimum(places, beside), np.maximum(places, beside))
            places = np.where(self.attacked()[:, np.newaxis], open_places, places)
        errors: FloatArray = places - position
        return errors
