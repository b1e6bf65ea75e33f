"""The reference of the warning game: the searched controller under a warning that is perfect."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cps_baselines.disbanding.string_controller import StringController
from cps_envs.core.policies.policy import RoleSpec, told_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, Observation, State

TOLD = ("disbanding_s", "position", "speed", "acceleration", "command")


class Informed(StringController):
    """Plays `string` with perfect warnings: it knows every disbanding at once, and its gains suit that."""

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, form="informed")

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What tells the truth of each episode, (B,), before what the controller keeps."""
        return told_of(knowledge), *super().begin(generators, knowledge)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The controller's corrections where every vehicle is told the truth."""
        shown = seen.observation
        if "warned" in seen:
            truths = [told["truth"] for told in state[0]]
            shown = self._corrected(shown, {name: np.stack([truth[name] for truth in truths]) for name in TOLD})
        actions, own = super().act(Seen(seen.fields, shown, seen.start, seen.deterministic), state[1:])
        return actions, (state[0], *own)

    def _corrected(self, observation: Observation, truth: Mapping[str, FloatArray]) -> Observation:
        """Observations (B, size) with a fresh record of the nearest disbanded vehicle ahead for everybody behind it."""
        size = self.spec.config.vehicles_per_platoon
        source = nearest_disbanded(truth["disbanding_s"], size)[:, size:]
        told, at = source >= 0, np.maximum(source, 0)
        taken = {name: np.take_along_axis(truth[name], at, axis=1) for name in TOLD[1:]}
        values = {
            "warned": np.ones(told.shape),
            "record_age_s": np.zeros(told.shape),
            "ahead_speed": taken["speed"],
            "ahead_acceleration": taken["acceleration"],
            "ahead_command": taken["command"],
            "ahead_distance": taken["position"] - truth["position"][:, size:],
        }
        shown = observation.copy()
        for name, value in values.items():
            part = self.spec.fields.slices[name]
            middle, half = self.spec.fields.scale[:, part]
            shown[:, part] = np.where(told, np.clip((value - middle) / half, -1.0, 1.0), shown[:, part])
        return shown


def nearest_disbanded(disbanding_s: FloatArray, size: int) -> IntArray:
    """The last vehicle of the nearest disbanded platoon ahead of each vehicle, (B, M), -1 where there is none.

    `disbanding_s` (B, N) from the front, +inf while intact; platoons have `size` vehicles.
    """
    platoons = disbanding_s.shape[1]
    last = np.where(np.isfinite(disbanding_s), np.arange(platoons) * size + size - 1, -1)
    ahead = np.maximum.accumulate(np.pad(last[:, :-1], ((0, 0), (1, 0)), constant_values=-1), axis=1)
    sources: IntArray = np.repeat(ahead, size, axis=1)
    return sources
