"""The reference of the warning game: the searched controller under a warning that is perfect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.disbanding.string_controller import StringController
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array


class Informed(StringController):
    """`string` told of every disbanding at once and without loss, with the numbers that were found for that."""

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, form="informed")

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Who tells the truth about each episode, (B,), before what the controller keeps."""
        told = np.array([known["truth"] for known in knowledge], object)
        return told, *(super().begin(generators, knowledge) or ())

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The controller's corrections where the true observations are seen."""
        assert state is not None  # begun
        truth = np.stack([tell() for tell in state[0]])
        actions, kept = super().act(Seen(seen.fields, truth, seen.start, seen.deterministic), state[1:] or None)
        return actions, (state[0], *(kept or ()))
