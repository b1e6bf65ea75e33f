"""The classes and functions that show a problem to Gymnasium and PettingZoo, made from its declaration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias, cast

from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.aec_env import RolesAECEnv
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import Role

Classes: TypeAlias = tuple[type[RoleEnv], type[RoleVectorEnv]]


@dataclass(frozen=True)
class Forms:
    """The environment classes and functions of a problem. A module that assigns them under these names offers them."""

    attack: Classes  # ...AttackEnv, ...AttackVectorEnv
    defense: Classes  # ...DefenseEnv, ...DefenseVectorEnv
    parallel_env: Callable[..., RolesParallelEnv | RolesVectorEnv]
    env: Callable[..., RolesAECEnv]
    swarm_env: Callable[..., SwarmEnv | SwarmVectorEnv]


def declare(
    problem: Problem,
    module: str,
    *,
    attack: str,
    defense: str,
    rhythm: str,
    swarm: str = "",
    threats: str = "",
) -> Forms:
    """The forms of a problem for the module of this name.

    `attack` and `defense` are the documentation pages of the two roles. `{observation_table}` and `{parameter_table}`
    in them are filled in by the problem, and `{threats}` by who knows what, who can touch what, and what it costs.
    `rhythm` says when the parallel form's agents act, as in "every 0.1 s". `swarm` says who the agents of a
    decentralised defence are.
    """
    pages = [page.replace("{threats}", threats) for page in (attack, defense)]
    config = type(problem.presets[problem.usual_preset]).__name__

    def parallel_env(num_envs: int | None = None, **kwargs: Any) -> RolesParallelEnv | RolesVectorEnv:
        if num_envs is not None:
            return RolesVectorEnv(problem, num_envs, **kwargs)
        return RolesParallelEnv(problem, **kwargs)

    def env(**kwargs: Any) -> RolesAECEnv:
        """`parallel_env` as a turn-based `pettingzoo.AECEnv`. The two moves of a step still count as simultaneous."""
        return RolesAECEnv(RolesParallelEnv(problem, **kwargs))

    def swarm_env(role: Role = "defender", num_envs: int | None = None, **kwargs: Any) -> SwarmEnv | SwarmVectorEnv:
        if num_envs is not None:
            return SwarmVectorEnv(problem, role, num_envs, **kwargs)
        return SwarmEnv(problem, role, **kwargs)

    parallel_env.__doc__ = (
        f"Attacker and defender in a `pettingzoo.ParallelEnv`. They act {rhythm}.\n\n"
        f"Arguments: `num_envs` (so many episodes at once; left out, one), `preset`, `interface`, `adapters` (role -> "
        f"what it is played through), `frame_skip`, `flat`, `render_mode`, `max_cycles` (the most steps) and any field "
        f"of `{config}`."
    )
    swarm_env.__doc__ = (
        f"{swarm}\n\nArguments: `role`, `num_envs` (so many episodes at once; left out, one), `preset`, `interface`, "
        f"`opponent` (who plays the other role), `adapter` (through which the agents play), `shared_pay`, "
        f"`frame_skip`, `flat`, `render_mode`, `max_cycles` and any field of `{config}`."
    )
    for function in (parallel_env, env, swarm_env):
        function.__module__, function.__qualname__ = module, function.__name__  # so that it can be pickled
    return Forms(
        attack=_classes(problem, "attacker", module, pages[0]),
        defense=_classes(problem, "defender", module, pages[1]),
        parallel_env=parallel_env,
        env=env,
        swarm_env=swarm_env,
    )


def _classes(problem: Problem, role: Role, module: str, page: str) -> Classes:
    """The single and the vector environment of a role."""
    name = class_name(problem, role)
    members: dict[str, Any] = {"__module__": module, "problem": problem, "role": role}
    single = type(f"{name}Env", (RoleEnv,), {**members, "__doc__": page})
    vector = type(f"{name}VectorEnv", (RoleVectorEnv,), {**members, "__doc__": f"`{name}Env` for a whole batch."})
    return cast(Classes, (single, vector))
