"""What there is: environments, presets and policies, as plain data for the command line and the documents."""

from __future__ import annotations

import inspect
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.metadata import EntryPoint
from typing import Any, get_type_hints

import gymnasium

from cps_envs.core.errors import MissingExtraError, UnknownNameError
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import load, policy_entry, policy_names
from cps_envs.core.policies.policy import setting_of
from cps_envs.core.types import ROLES, Role


@dataclass(frozen=True)
class PolicyEntry:
    """A policy that can be asked for by name."""

    name: str
    summary: str  # first line of its docstring, or of its module's
    privileged: tuple[str, ...]  # what it needs to know beyond its observations; an oracle if not empty
    plays_in: str = ""  # such as "paper", if it cannot play `learning`; else empty
    missing: str = ""  # the package without which it cannot be imported


def describe_problem(problem: Problem) -> dict[str, Any]:
    """Ids, presets and policies of a problem; one of your own may have no ids."""
    known = problem.env_id("attacker") in gymnasium.registry
    return {
        "name": problem.name,
        "summary": problem.summary,
        "gymnasium": {role: f"{problem.namespace}:{problem.env_id(role)}" for role in ROLES if known},
        "pettingzoo": pettingzoo_ids(problem) if known else {},
        "presets": list(problem.presets),
        "policies": {role: [asdict(entry) for entry in policies(problem, role)] for role in ROLES},
    }


def pettingzoo_ids(problem: Problem) -> dict[str, str]:
    """PettingZoo's id of a problem, and the functions of its module: parallel, turn-based, decentralised."""
    module = str(gymnasium.spec(problem.env_id("attacker")).entry_point).partition(":")[0]
    ids = {"id": f"{problem.namespace}/{problem.name}-v{problem.version}"}
    swarm = {"swarm": "swarm_env"} if problem.swarm and hasattr(import_module(module), "swarm_env") else {}
    offers = {"parallel": "parallel_env", "aec": "env", **swarm}
    return ids | {form: f"{module}.{function}" for form, function in offers.items()}


def policies(problem: Problem, role: Role) -> list[PolicyEntry]:
    """The policies of a role that have names; they are imported."""
    entries = {name: policy_entry(problem.name, role, name) for name in policy_names(problem.name, role)}
    return [_describe(name, entry) for name, entry in entries.items() if entry is not None]


def _describe(name: str, entry: EntryPoint) -> PolicyEntry:
    """A policy as its docstring describes it; of one that cannot be imported, why."""
    try:
        target = load(entry)
    except MissingExtraError as error:
        return PolicyEntry(name, "", (), missing=error.name or "")
    except UnknownNameError as error:
        return PolicyEntry(name, str(error), ())
    return PolicyEntry(name, summary_of(target), tuple(sorted(_privileges(target))), setting_of(target))


def summary_of(target: Any) -> str:
    """The first sentence or line of a docstring, the module's if the target itself has none."""
    own = vars(target).get("__doc__") if inspect.isclass(target) else target.__doc__
    text = own or inspect.getdoc(inspect.getmodule(target)) or ""
    return inspect.cleandoc(text).partition("\n")[0]


def _privileges(target: Any) -> frozenset[str]:
    """What a policy class, a function that returns a policy, or a policy declares to need."""
    made = target if inspect.isclass(target) else get_type_hints(target).get("return", target)
    privileged: frozenset[str] = getattr(made, "privileged", frozenset())
    return privileged
