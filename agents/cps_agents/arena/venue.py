"""The configuration in which policies meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cps_envs.registration import find_problem


@dataclass(frozen=True)
class Venue:
    """The configuration in which policies meet."""

    problem: str  # name, or module:attribute of a problem of your own
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)

    @property
    def config(self) -> Any:
        """The configuration itself."""
        return find_problem(self.problem).config(self.preset, self.overrides)

    def changed(self, overrides: Mapping[str, Any]) -> Venue:
        """The venue with more fields set."""
        return Venue(self.problem, self.preset, {**self.overrides, **overrides})
