"""One table of problems, registered with Gymnasium and PettingZoo when the package is imported."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from cps_envs.core.errors import ConfigurationError, UnknownNameError, near, shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces import registration as core
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import ROLES, Role
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.fdi.problem import FDI
from cps_envs.hvac.problem import HVAC
from cps_envs.rogue.problem import ROGUE

if TYPE_CHECKING:  # it brings the compiler of kernels along
    from cps_envs.core.interfaces.learning_env import LearningVectorEnv

PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in (DISBANDING, FDI, HVAC, ROGUE)}


def find_problem(name: str) -> Problem:
    """The problem of a name such as "disbanding", or the one at `"module:attribute"`, such as your own.

    Raises:
        UnknownNameError: there is none; the message names the near ones.
        UntrustedCodeError: `module:attribute` without the user's consent, see `cps_envs.trust`.
    """
    module, colon, attribute = name.partition(":")
    if name in PROBLEMS:
        return PROBLEMS[name]
    if not colon:
        own = "One of your own is written MODULE:PROBLEM, behind --trust"
        raise UnknownNameError(f"there is no problem {name!r}. {near(name, PROBLEMS)} {own}")
    require_trust(name)
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(f"no problem can be imported from {name!r}: {error}") from error
    if not isinstance(found, Problem):
        raise UnknownNameError(f"{name!r} is no problem but {found!r}")
    return found


def find_role(name: str) -> tuple[Problem, Role]:
    """The problem and role of a name such as "RogueAttack", or of an id as Gymnasium takes it, such as your own.

    Raises:
        UnknownNameError: there is none; the message names the near ones.
    """
    module, colon, env_id = name.rpartition(":")
    if colon:
        import_module(module)
    known = {core.class_name(problem, role): problem.env_id(role) for problem in PROBLEMS.values() for role in ROLES}
    spec = gymnasium.registry.get(known.get(env_id, env_id))
    point = None if spec is None else spec.entry_point
    found: Any = load_env_creator(point) if isinstance(point, str) else point
    if not isinstance(getattr(found, "problem", None), Problem):
        raise UnknownNameError(f"there is no role {name!r}. {near(name, known)}")
    return found.problem, found.role


def learning_env(name: str, num_envs: int | None = None, *, device: str = "cpu", **options: Any) -> LearningVectorEnv:
    """A role as ordinary learners like it, see `core.interfaces.learning_env.LearningVectorEnv` for the options.

    `name` is such as "RogueAttack", or an id as Gymnasium takes it. With `device="cuda"` a GPU plays the same episodes,
    see `core.interfaces.card_env.CardVectorEnv`; experimental.

    Raises:
        UnknownNameError: there is no such role, or no such adapter.
        ConfigurationError: an option that cannot be right.
    """
    from cps_envs.core.interfaces.learning_env import LearningVectorEnv

    problem, role = find_role(name)
    if device == "cuda":
        from cps_envs.core.interfaces.card_env import CardVectorEnv

        return CardVectorEnv(problem, role, num_envs, **options)
    if device != "cpu":
        raise ConfigurationError(f'device = {shown(device)} must be "cpu" or "cuda"')
    return LearningVectorEnv(problem, role, num_envs, **options)


@dataclass(frozen=True)
class LoadedConfig:
    """A system of one's own, as a configuration file describes it."""

    problem: Problem
    preset: str
    overrides: Mapping[str, Any]  # changed fields
    config: Any  # the configuration itself, as `play_episodes` takes it


def load_config(path: str | os.PathLike[str]) -> LoadedConfig:
    """The system in a TOML file, see `cps-envs list PROBLEM --config`. Environments take the path itself as `config`.

    Raises:
        DamagedFileError: the file is no TOML, or has other entries than such a file.
        ConfigurationError: it is not there, or has fields that cannot be right.
        UnknownNameError: there is no such problem.
    """
    from cps_envs.core.game.configuration_file import read_configuration

    found = read_configuration(path)
    try:
        problem = find_problem(found.problem)
    except UnknownNameError as error:
        raise UnknownNameError(f"{found.path}: {error}") from error
    preset, overrides = replace(found, problem=problem.name).of(problem, None, {})
    return LoadedConfig(problem, preset, overrides, problem.config(preset, overrides))


def register_all() -> None:
    """Register every id that is not registered yet."""
    for problem in PROBLEMS.values():
        core.register(problem, f"cps_envs.{problem.name}_v{problem.version}")
