"""Who meets where, as plain data: venues and contestants, of which every table is made."""

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


@dataclass(frozen=True)
class Contestant:
    """A policy that takes part, with what is known of it beside its reference."""

    name: str
    policy: str = ""  # reference, as `cps-envs play` takes it; the name itself if empty
    title: str = ""  # in the tables, where the name does not say enough
    overrides: Mapping[str, Any] = field(default_factory=dict)  # of the venue where it plays, such as how it observes
    episodes: int = 0  # where they are not those of the table
    metric: str = ""  # what its row shows, where it is not that of the table

    @property
    def heading(self) -> str:
        """What the tables call it."""
        return self.title or self.name

    @property
    def reference(self) -> str:
        """The policy to look up."""
        return self.policy or self.name
