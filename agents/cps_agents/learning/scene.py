"""Where and against whom the candidates of a policy search play."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Scene:
    """A part of the episodes that judge a candidate; what is empty here is the recipe's."""

    episodes: int
    opponent: str = ""
    preset: str = ""
    overrides: Mapping[str, Any] = field(default_factory=dict)  # on top of the recipe's


def count_episodes(scenes: Sequence[Scene]) -> int:
    """How many episodes judge a candidate."""
    return sum(scene.episodes for scene in scenes)
