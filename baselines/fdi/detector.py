"""Base of the defenders, an extension beyond the paper: they decide step by step which readings to use."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np

from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray
from cps_envs.fdi.config import FdiConfig

Seen = Mapping[str, FloatArray]  # the defender's decoded observation
ROUNDING = 1e-3  # m and m/s; observations are of single precision


class Detector(AnalyticPolicy):
    """Base: distrusted readings are replaced from the next step on; commands are never corrected."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config

    @abstractmethod
    def blank(self, envs: int) -> Array:
        """What is remembered of an episode, (B, ...), at its start."""

    @abstractmethod
    def distrust(self, seen: Seen, memory: Array) -> tuple[BoolArray, Array]:
        """Readings (B, 2n), ranges 1..n, then range-rates, that are not to be used, and what to remember."""

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, 3n): trust in every reading, then no correction."""
        memory = self.blank(len(observation))
        if state is not None:
            fresh = np.zeros(len(memory), np.bool_) if episode_start is None else episode_start
            memory[~fresh] = state[0][~fresh]
        distrusted, memory = self.distrust(self.spec.fields.decode(observation), memory)
        actions = np.repeat(self.spec.neutral_action[np.newaxis], len(observation), axis=0)
        actions[:, : 2 * self.config.num_vehicles] = ~distrusted
        return actions, (memory,)
