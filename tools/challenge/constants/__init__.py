"""Policies that take one action, all or a grid of them: the best of a role has the score 0 in its track."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from cps_envs.core.types import Role


def declared(problem: str, role: Role) -> tuple[str, ...]:
    """The constants of a role, which `tools/challenge/constants/<problem>.py` declares as `CONSTANTS`."""
    constants: Mapping[Role, tuple[str, ...]] = import_module(f"tools.challenge.constants.{problem}").CONSTANTS
    return constants[role]
