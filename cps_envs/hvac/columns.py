"""Columns of what the agents of a team see: how they are declared, squeezed and put together."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.types import FloatArray, Observation

# Below this size a squeezed column is nearly linear, beyond it logarithmic, so that it shows drift and attack alike.
SMALL = {"C": 0.3, "std": 0.3}  # chosen: about what drifting heat does


def squeezed(name: str, unit: str, most: float, meaning: str) -> Field:
    """A field of arsinh(value / small), for values of either sign up to `most`."""
    end = float(squeeze(np.array(most), unit))
    return Field(name, f"arsinh({unit}/{SMALL[unit]:g})", -end, end, (), meaning)


def squeeze(values: FloatArray, unit: str) -> FloatArray:
    """The values of a `squeezed` field from those in its unit, of the same shape."""
    narrow: FloatArray = np.arcsinh(values / SMALL[unit])
    return narrow


def encoded(fields: Fields, columns: Mapping[str, FloatArray]) -> Observation:
    """The rows (B, S, size) of S agents from each field's values, (B or 1, S or 1, *shape)."""
    leads = np.broadcast_shapes(*(column.shape[:2] for column in columns.values()))
    values = np.empty((*leads, fields.size))
    for field in fields:
        column, part = columns[field.name], fields.slices[field.name]
        values[..., part] = column if field.shape else column[..., np.newaxis]
    return fields.encode(values.reshape(-1, fields.size)).reshape(values.shape)
