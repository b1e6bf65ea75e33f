"""Named entries of an observation: units, fixed physical bounds, encoding to [-1, 1], decoding, documentation."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import borrowed, inlined, kernel, with_attributes
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import Array, FloatArray, Observation


@dataclass(frozen=True)
class Field:
    """One named block of an observation, with the physical values that are mapped to -1 and 1.

    A block that a configuration leaves out has the shape (0,): it keeps its name for kernels and takes no room.
    """

    name: str
    unit: str
    low: float
    high: float
    shape: tuple[int, ...] = ()
    description: str = ""

    def __post_init__(self) -> None:
        if not -math.inf < self.low < self.high < math.inf:
            raise ValueError(f"field {self.name!r}: low = {self.low} has to be below high = {self.high}, both finite")

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)


@functools.cache
def _offsets_type(names: tuple[str, ...]) -> np.dtype[np.void]:
    """One object for each layout, see `kernels.record_type`."""
    return np.dtype([(name, np.int64) for name in names])


class Fields(Sequence[Field]):
    """The layout of an observation vector: its fields one after the other, each flattened in C order."""

    def __init__(self, *fields: Field) -> None:
        names = [field.name for field in fields]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"an observation needs fields, each with a name of its own; got {names}")
        self._fields = fields
        ends = np.cumsum([field.size for field in fields]).tolist()
        starts = [0, *ends[:-1]]
        self.slices = {field.name: slice(a, b) for field, a, b in zip(fields, starts, ends, strict=True)}
        self.size = ends[-1]
        # (1,) where each field begins, by name: kernels write `row[at.speed + i]` with `at = offsets[0]`
        self.offsets: Array = with_attributes(np.array([tuple(starts)], _offsets_type(tuple(names))))
        low = np.concatenate([np.full(field.size, field.low) for field in fields])
        high = np.concatenate([np.full(field.size, field.high) for field in fields])
        self.scale: FloatArray = np.stack(
            [(low + high) / 2, (high - low) / 2]
        )  # (2, size): where 0 lies, and 1 from it
        parts = {field.name: (self.slices[field.name], field.shape) for field in fields}
        self._parts = {name: (part, *self.scale[:, part], shape) for name, (part, shape) in parts.items()}

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        return self._fields[index]

    def __len__(self) -> int:
        return len(self._fields)

    def __iter__(self) -> Iterator[Field]:
        return iter(self._fields)

    def space(self) -> spaces.Box:
        """The observation space of one environment."""
        return spaces.Box(-1.0, 1.0, (self.size,), np.float32)

    def encode(self, values: FloatArray) -> Observation:
        """Values (B, size) in the fields' units as a fresh float32 array in [-1, 1]; what lies outside is clipped."""
        encoded = np.empty(values.shape, np.float32)
        _encode(values, self.scale, encoded)
        return encoded

    def decode(self, observation: Array) -> dict[str, FloatArray]:
        """The physical values of each field, (..., *field.shape), from encoded observations (..., size).

        Raises:
            ValueError: the last axis has another size than these fields.
        """
        self._check(observation)
        values, lead = observation * self.scale[1] + self.scale[0], observation.shape[:-1]
        return {field.name: values[..., self.slices[field.name]].reshape(lead + field.shape) for field in self}

    def decode_field(self, name: str, observation: Array) -> FloatArray:
        """The physical values (..., *field.shape) of one field from encoded observations (..., size).

        Raises:
            UnknownNameError: there is no such field; the message names the near ones.
            ValueError: the last axis has another size than these fields.
        """
        if name not in self._parts:
            raise UnknownNameError(f"there is no field {name!r}. {near(name, self._parts)}")
        self._check(observation)
        part, middle, half, shape = self._parts[name]
        values: FloatArray = observation[..., part] * half
        values += middle
        return values.reshape(observation.shape[:-1] + shape)

    def _check(self, observation: Array) -> None:
        if observation.shape[-1] != self.size:
            raise ValueError(f"an observation of {self.size} entries was expected, got shape {observation.shape}")

    def table(self) -> str:
        """A Markdown table in Gymnasium's manner: Num, Name with its shape, Min, Max, Unit, what each field means."""
        rows = ["| Num | Name | Min | Max | Unit | Meaning |", "|---|---|---|---|---|---|"]
        for field in self:
            if field.size == 0:
                continue
            part = self.slices[field.name]
            num = f"{part.start}" if field.size == 1 else f"{part.start}-{part.stop - 1}"
            bounds = f"{field.low:g} | {field.high:g}"
            shape = f"[{', '.join(map(str, field.shape))}]" if len(field.shape) > 1 else ""
            rows.append(f"| {num} | `{field.name}{shape}` | {bounds} | {field.unit} | {field.description} |")
        return "\n".join(rows)


@inlined
def encode_row(values: FloatArray, scale: FloatArray, encoded: Observation) -> None:
    """`Fields.encode` of one environment's values (size,) for kernels, into a row of an observation."""
    for entry in range(values.size):
        scaled = (values[entry] - scale[0, entry]) / scale[1, entry]
        encoded[entry] = 1.0 if scaled > 1.0 else -1.0 if scaled < -1.0 else scaled  # NaN stays visible


@inlined
def decode_entry(row: Observation, scale: FloatArray, entry: int) -> float:
    """`Fields.decode` of one entry of an observation (size,), for kernels."""
    value: float = row[entry] * scale[1, entry] + scale[0, entry]
    return value


@kernel
def _encode(values: FloatArray, scale: FloatArray, encoded: Observation) -> None:
    for b in range(values.shape[0]):
        encode_row(borrowed(values)[b], borrowed(scale), borrowed(encoded)[b])
