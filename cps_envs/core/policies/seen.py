"""What a policy sees of a batch of environments at a decision."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cps_envs.core.types import Array, BoolArray, FloatArray, Observation

if TYPE_CHECKING:  # fields bring the compiler of kernels along
    from cps_envs.core.declare.fields import Fields


class Seen:
    """The observations of B environments; `seen["speed"]` is that field in its unit, `(B, *field.shape)`.

    A field is decoded when it is first asked for, and at once for all slices of the same whole. `len(seen)` is B and
    `"speed" in seen` tells whether the field is there; one that the configuration leaves out has the shape (0,) and
    does not count.
    """

    def __init__(
        self,
        fields: Fields,
        observation: Observation,
        start: BoolArray | None = None,
        deterministic: bool = False,
        masks: BoolArray | None = None,
        team: Observation | None = None,
    ) -> None:
        self.fields = fields
        self.observation = observation  # (B, n) encoded, float32
        self.start: BoolArray = np.zeros(len(observation), np.bool_) if start is None else start  # (B,) episode begins
        self.deterministic = deterministic  # asks for the most likely action of a policy that draws
        self.masks = masks  # (B, k) legal actions; None where all are legal, or the policy does not ask for them
        self.team = team  # (B, A, m) what each agent of the role's team sees; None where the policy does not ask for it
        self._decoded: dict[str, FloatArray] = {}
        self._whole: tuple[Seen, slice] | None = None  # that of which this is a slice

    def __getitem__(self, name: str) -> FloatArray:
        found = self._decoded.get(name)
        if found is None:
            if self._whole is None:
                found = self.fields.decode_field(name, self.observation)
            else:
                whole, mine = self._whole
                found = whole[name][mine]
            self._decoded[name] = found
        return found

    def __contains__(self, name: object) -> bool:
        part = self.fields.slices.get(str(name))
        return part is not None and part.stop > part.start

    def __len__(self) -> int:
        return len(self.observation)

    def part(self, envs: Array | slice) -> Seen:
        """What some of the environments show: a slice of them, their indices (k,), or those that are marked (B,)."""
        masks = None if self.masks is None else self.masks[envs]
        team = None if self.team is None else self.team[envs]
        part = Seen(self.fields, self.observation[envs], self.start[envs], self.deterministic, masks, team)
        if isinstance(envs, slice):
            part._whole = self, envs
        return part
