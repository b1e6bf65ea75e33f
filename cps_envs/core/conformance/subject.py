"""What is put through the checks: one role of a problem, with all the interfaces that show it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator, parse_env_id
from gymnasium.vector import AutoresetMode

from cps_envs.core.declare.training import NATIVE
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import Role

NUM_ENVS = 3  # of the batches that the checks make


class NotApplicableError(Exception):
    """A check has no meaning for a subject, or needs a package that is not installed; suites report it as skipped."""


@dataclass(frozen=True)
class Subject:
    """One role of a problem under given arguments, in the native interface unless `kwargs` say otherwise.

    `variants` are further keyword arguments, each merged over `kwargs`, under which together every observation entry
    has to come alive.
    """

    single_class: type[RoleEnv]
    vector_class: type[RoleVectorEnv]
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    env_id: str | None = None  # as `gymnasium.make` takes it, with the module that registers it
    variants: Sequence[Mapping[str, Any]] = ()
    parallel_class: Callable[..., RolesParallelEnv] = RolesParallelEnv
    swarm_class: Callable[..., SwarmEnv] = SwarmEnv
    parallel_vector_class: Callable[..., RolesVectorEnv] = RolesVectorEnv
    swarm_vector_class: Callable[..., SwarmVectorEnv] = SwarmVectorEnv

    def __str__(self) -> str:
        arguments = "".join(f", {name}={value!r}" for name, value in self.kwargs.items())
        return f"{self.env_id or self.single_class.__name__}{arguments}"

    @property
    def problem(self) -> Problem:
        """The problem that the environment belongs to."""
        return self.single_class.problem

    @property
    def role(self) -> Role:
        """The role that the environment trains."""
        return self.single_class.role

    @property
    def arguments(self) -> dict[str, Any]:
        """What every interface of the role is made with."""
        return {"interface": NATIVE, **self.kwargs}

    @property
    def interface(self) -> str:
        """Which interface is checked: "native" or "learning"."""
        return str(self.arguments["interface"])

    @property
    def is_learned(self) -> bool:
        """Whether the problem says how the role is learned, in the preset that is checked."""
        preset = self.kwargs.get("preset", self.problem.usual_preset)
        return preset == LEARNING and self.role in self.problem.training

    @property
    def game_kwargs(self) -> dict[str, Any]:
        """The arguments without those of one role, for the interface that plays both roles from outside."""
        apart = ("opponent", "frame_skip", "adapter")
        found = {name: value for name, value in self.arguments.items() if name not in apart}
        adapter = self.kwargs.get("adapter")
        return found if adapter is None else {**found, "adapters": {self.role: adapter}}

    @property
    def shared_pay(self) -> bool:
        """Whether each agent of a team is paid what the whole is."""
        usual = self.problem.training[self.role].shared_pay if self.role in self.problem.training else False
        return bool(self.kwargs.get("shared_pay", usual)) and self.interface == LEARNING

    def paid(self, rewards: Sequence[float]) -> float:
        """What the role is paid where its agents are paid this."""
        return rewards[0] if self.shared_pay else sum(rewards)

    def single(self, **extra: Any) -> RoleEnv:
        """A fresh `gymnasium.Env`."""
        return self.single_class(**{**self.arguments, **extra})

    def batch(self, num_envs: int = NUM_ENVS, **extra: Any) -> RoleVectorEnv:
        """A fresh vector environment, which resets ended environments in the same step unless told otherwise."""
        return self.vector_class(num_envs, **{"autoreset": AutoresetMode.SAME_STEP, **self.arguments, **extra})

    def parallel(self, **extra: Any) -> RolesParallelEnv:
        """A fresh PettingZoo environment of both roles."""
        return self.parallel_class(self.problem, **{**self.game_kwargs, **extra})

    def parallel_batch(self, num_envs: int = NUM_ENVS, **extra: Any) -> RolesVectorEnv:
        """A fresh batch of the PettingZoo environment of both roles."""
        return self.parallel_vector_class(self.problem, num_envs, **{**self.game_kwargs, **extra})

    def swarm_batch(self, num_envs: int = NUM_ENVS, **extra: Any) -> SwarmVectorEnv:
        """A fresh batch of the PettingZoo environment of the role as a team."""
        return self.swarm_vector_class(self.problem, self.role, num_envs, **{**self.arguments, **extra})

    def swarm(self, **extra: Any) -> SwarmEnv:
        """A fresh PettingZoo environment of the role as a team.

        Raises:
            NotApplicableError: the role has no decentralised form under these arguments.
        """
        try:
            return self.swarm_class(self.problem, self.role, **{**self.arguments, **extra})
        except (TypeError, ValueError) as error:
            raise NotApplicableError(f"no swarm form: {error}") from error

    def game(self, num_envs: int = 1) -> Game:
        """A game that nobody has started."""
        return self.batch(num_envs).game

    def interfaces(self) -> dict[str, Callable[[], Any]]:
        """The interfaces of this role by name; each call makes a fresh environment."""
        interfaces: dict[str, Callable[[], Any]] = {
            "single": self.single,
            "batch": self.batch,
            "parallel": self.parallel,
            "batched parallel": self.parallel_batch,
        }
        if self.interface == LEARNING and self.batch(1, per_agent=True).agents > 1:
            interfaces["per-agent"] = partial(self.batch, per_agent=True)
        try:
            self.swarm()
        except NotApplicableError:
            return interfaces
        return {**interfaces, "swarm": self.swarm}


def find_subject(
    target: str | type[RoleEnv], kwargs: Mapping[str, Any], variants: Sequence[Mapping[str, Any]] = ()
) -> Subject:
    """The subject of a Gymnasium id (with its module, "package:namespace/Name-v0", if need be) or of a `RoleEnv` class.

    Raises:
        TypeError: what was found is not built on the core.
    """
    if not isinstance(target, str):
        return Subject(_checked(target), _vector_class(target), kwargs, variants=variants)
    module, colon, env_id = target.rpartition(":")
    if colon:
        importlib.import_module(module)
    spec = gymnasium.spec(env_id)
    single = _checked(load_env_creator(spec.entry_point) if isinstance(spec.entry_point, str) else spec.entry_point)
    module = module or _registering_module(single, spec.id)
    vector = spec.vector_entry_point
    vector_class = load_env_creator(vector) if isinstance(vector, str) else vector or _vector_class(single)
    return Subject(single, vector_class, kwargs, f"{module}:{spec.id}", variants)  # type: ignore[arg-type]


def _registering_module(single: type[RoleEnv], env_id: str) -> str:
    """The package whose import registers an id: the one named like the id's namespace, else the class's own module."""
    namespace, top = parse_env_id(env_id)[0], single.__module__.partition(".")[0]
    return top if namespace == top else single.__module__


def _checked(found: Any) -> type[RoleEnv]:
    if not (isinstance(found, type) and issubclass(found, RoleEnv)):
        raise TypeError(
            f"{found!r} is no subclass of cps_envs.core.interfaces.env.RoleEnv: these checks do not apply to it"
        )
    return found


def _vector_class(single: type[RoleEnv]) -> type[RoleVectorEnv]:
    """The vector interface beside a class in its module; a fresh one where the module has none."""
    for found in vars(sys.modules[single.__module__]).values():
        if isinstance(found, type) and issubclass(found, RoleVectorEnv) and hasattr(found, "problem"):
            same = (found.problem, found.role) == (single.problem, single.role)
            if same:
                return found
    return type(f"{single.__name__}Vector", (RoleVectorEnv,), {"problem": single.problem, "role": single.role})
