"""Episodes of false data injection for the tests of its policies."""

from __future__ import annotations

from typing import Any

from cps_envs.core.play import play_episodes
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import Array, Role
from cps_envs.fdi.problem import FDI


def play(
    attacker: Any, defender: Any = "none", seeds: Any = (0,), preset: str = "paper", **overrides: Any
) -> dict[str, Array]:
    """The outcome of an episode per seed."""
    config = FDI.config(preset, overrides)
    return play_episodes(FDI, config, {"attacker": attacker, "defender": defender}, seeds)


def task_settings(task: Any) -> dict[str, Any]:
    """The overrides that fix a task, "x4>4" or a `Task`."""
    attacked, target = str(task).split(">")
    return {"attacked": attacked, "target": int(target)}


def spec_of(role: Role, preset: str = "paper", **overrides: Any) -> RoleSpec:
    """The interface of a role."""
    return FDI.game(FDI.config(preset, overrides), 1).spec(role)
