"""What a role did, saw and believed over an episode, as rows of small whole numbers that a page can draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.fields import Fields
from cps_envs.core.types import Array, FloatArray

FINE, COARSE = 999, 99  # steps between the least and the greatest value: of few rows, and of many
FEW_ROWS, MOST_ROWS = 6, 48  # drawn as lines; drawn at all


@dataclass(frozen=True)
class Track:
    """A quantity at k moments, in r rows."""

    name: str
    values: FloatArray  # (k, r)
    unit: str = ""
    about: str = ""
    whole: bool = False  # values are choices 0, 1, ...
    labels: Sequence[str] = ()  # of the rows

    def document(self) -> dict[str, Any]:
        """Plain data; `rows` are whole numbers from 0 to `steps`, which stand for `low` to `high`."""
        every = np.nan_to_num(self.values, posinf=0.0, neginf=0.0)
        rows = every.T[:: -(-every.shape[1] // MOST_ROWS)]
        low, high = float(rows.min()), float(rows.max())
        steps = (round(high - low) or 1) if self.whole else FINE if len(rows) <= FEW_ROWS else COARSE
        scaled = np.zeros(rows.shape) if high == low else (rows - low) / (high - low) * steps
        return {
            "name": self.name,
            "unit": self.unit,
            "about": self.about,
            "whole": self.whole,
            "labels": list(self.labels) if len(self.labels) == len(rows) else [],
            "count": every.shape[1],  # of rows, before some are left out
            "low": float(f"{low:.5g}"),
            "high": float(f"{high:.5g}"),
            "steps": steps,
            "rows": np.rint(scaled).astype(int).tolist(),
        }


@dataclass
class Diary:
    """A role's moments."""

    observations: list[Array] = field(default_factory=list)  # (size,) each
    actions: list[Array] = field(default_factory=list)
    beliefs: list[Mapping[str, Array]] = field(default_factory=list)  # (r,) each

    def document(self, fields: Fields, space: spaces.Space[Any], moments: Sequence[int]) -> dict[str, Any]:
        """The tracks of what was done, seen and believed at some moments."""
        parts = {
            "actions": [action_track(np.array(self.actions)[moments], space)],
            "observations": observation_tracks(np.array(self.observations)[moments], fields),
            "beliefs": belief_tracks([self.beliefs[place] for place in moments]),
        }
        return {name: [track.document() for track in tracks] for name, tracks in parts.items()}


def action_track(actions: Array, space: spaces.Space[Any]) -> Track:
    """The actions (k, ...) in force at each moment."""
    rows = actions.reshape(len(actions), -1).astype(np.float64)
    discrete = isinstance(space, (spaces.Discrete, spaces.MultiDiscrete))
    about = "number of the choice" if discrete else "share of the largest possible"
    return Track("Action", rows, about=about, whole=discrete)


def observation_tracks(observations: Array, fields: Fields) -> list[Track]:
    """What was observed, field by field in physical units; `observations` (k, size) are encoded."""
    decoded = fields.decode(observations)
    return [
        Track(each.name, decoded[each.name].reshape(len(observations), -1), each.unit, each.description)
        for each in fields
        if each.size
    ]


def belief_tracks(beliefs: Sequence[Mapping[str, Array]]) -> list[Track]:
    """What a policy told of its beliefs at each moment; nothing where it told none."""
    if not beliefs:
        return []
    return [
        Track(name, np.array([np.ravel(each[name]) for each in beliefs], np.float64))
        for name in beliefs[-1]
        if all(name in each for each in beliefs)
    ]
