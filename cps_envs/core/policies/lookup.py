"""Finding a policy by name, by `module:attribute`, or by being handed it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from functools import lru_cache, partial
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, TypeAlias

from gymnasium import spaces

from cps_envs.core.errors import EXTRAS, ConfigurationError, MissingExtraError, UnknownNameError, near, shown
from cps_envs.core.policies.options import check_policy_options
from cps_envs.core.policies.policy import Policy, RoleSpec, is_decentralised
from cps_envs.core.policies.reference import Reference, parse_reference
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import Role

GROUP = "cps_envs.policies"
SOURCES = "cps_envs.policy_sources"
BUILT_IN = {  # for every role of every problem
    "always": "cps_envs.core.policies.always:Always",
    "mixture": "cps_envs.core.policies.mixture:Mixture",
    "none": "cps_envs.core.policies.policy:Idle",
    "trace": "cps_envs.core.policies.trace:Trace",
    "random": "cps_envs.core.policies.uniform:Uniform",  # where no registered policy has this name
}
MODELS = "sb3"  # the source that also plays models handed over as objects, which tell their spaces
NEED_OPTIONS = ("always", "mixture", "trace")  # of these; without options they are nothing
SHOWN = 80  # characters of a policy that is described in an error
PolicyReference: TypeAlias = str | Policy


@lru_cache(maxsize=2)
def _registered(group: str = GROUP) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=group)}


def policy_names(problem: str, role: Role) -> list[str]:
    """The names of a role's policies, sorted: registered ones, and those that every role has."""
    prefix = f"{problem}.{role}."
    return sorted({name.removeprefix(prefix) for name in _registered() if name.startswith(prefix)} | set(BUILT_IN))


def policy_entry(problem: str, role: Role, name: str) -> EntryPoint | None:
    """Where the policy of a name comes from; None if nothing has this name."""
    full = f"{problem}.{role}.{name}"
    if name in BUILT_IN and full not in _registered():
        return EntryPoint(full, BUILT_IN[name], GROUP)
    return _registered().get(full)


def load(entry: EntryPoint) -> Any:
    """What an entry point names.

    Raises:
        MissingExtraError: a package that it needs, and that an extra brings, is not installed.
        UnknownNameError: it names what is not there, or its module cannot be imported.
    """
    try:
        return entry.load()
    except Exception as error:  # whatever a package of somebody else does
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing in EXTRAS:
            text = f"the policy {entry.name!r} needs the package {missing!r}, which is not installed. "
            remedy = f'Install it with: pip install "cps-envs[{EXTRAS[missing]}]"'
            raise MissingExtraError(text + remedy, name=missing) from error
        fault = _fault(entry, error, missing)
        raise UnknownNameError(f"the entry point {entry.name} names {entry.value}, but {fault}") from error


def _fault(entry: EntryPoint, error: Exception, missing: str | None) -> str:
    """What is wrong with an entry point, and what to do about it."""
    remedy = "Correct its line in pyproject.toml and install its package again (ours: make setup)"
    if f"{entry.module}.".startswith(f"{missing}."):
        return f"there is no module {missing!r}. {remedy}"
    module = sys.modules.get(entry.module)
    if module is None:
        return f"the module cannot be imported: {type(error).__name__}: {error}"
    known = [name for name, each in vars(module).items() if getattr(each, "__module__", "") == entry.module]
    return f"the module has no {entry.attr!r}. {near(entry.attr, known)} {remedy}"


def parsed(reference: str) -> Reference:
    """The tree of a reference, with the sources that are installed.

    Raises:
        ConfigurationError: its options are malformed.
    """
    return parse_reference(reference, _registered(SOURCES))


def source_entry(name: str) -> EntryPoint | None:
    """Where a source of policies, such as `zoo`, comes from; None if nothing has this name."""
    return _registered(SOURCES).get(name)


def resolve_policy(reference: PolicyReference, spec: RoleSpec, **options: Any) -> Policy:
    """The policy that a reference names.

    `reference` is one of these:

    - an object with `predict`, used as it is, or as the source `sb3` plays it where it tells its spaces, as models do;
    - a registered name such as `"heuristic"`;
    - a registered source and a name for it, such as `"zoo:hvac-attack"`, called as `source(name, spec, **options)`;
    - `"module:attribute"`: a policy, or what makes one when called as `attribute(spec, **options)`. This runs any code,
      so the user has to agree first, see `cps_envs.trust`.

    A string can end in options, like a query: `"plan?events=[[10,1]]"`. Values are read as JSON where possible, see
    `cps_envs.core.policies.reference`.

    Raises:
        UnknownNameError: no such name, module or attribute, or an entry point that names none.
        UntrustedCodeError: `module:attribute` without the user's consent.
        MissingExtraError: the policy needs a package that is not installed.
        TypeError: what was found is no policy, or is built already and takes no options.
        ConfigurationError: the policy is for another role or problem, or has other spaces; or it has no such options,
            or they are malformed or do not fit it.
    """
    if not isinstance(reference, str):
        return _checked(reference, shown(reference), spec, options)
    found = parsed(reference)
    options = {**found.options, **options}
    target = _load(found, spec)
    if not isinstance(target, type) and hasattr(target, "predict"):
        return _checked(target, reference, spec, options)
    check_policy_options(target, options, _short(found.title))
    try:
        built = target(spec, **options)
    except TypeError as error:
        raise TypeError(f"the policy {_short(reference)!r} could not be built: {error}") from error
    except ConfigurationError:
        raise
    except (ValueError, AttributeError, ArithmeticError, IndexError, KeyError, RecursionError) as error:
        if not options:
            raise
        raise ConfigurationError(
            f"the policy {_short(reference)!r} cannot be built with these options: {error}"
        ) from error
    return _checked(built, reference, spec)


def _load(reference: Reference, spec: RoleSpec) -> Any:
    name, module = reference.title, reference.source
    entry = policy_entry(spec.problem, spec.role, name.removeprefix(f"{spec.problem}.{spec.role}."))
    if entry is not None:
        return load(entry)
    if (source := source_entry(module)) is not None:
        return partial(load(source), reference.name)
    if not module:
        known = policy_names(spec.problem, spec.role)
        raise UnknownNameError(
            f"{spec.problem} has no {spec.role} policy {name!r}. {_owner(name, spec)}{near(name, known)} "
            "If it is new, install its package again."
        )
    require_trust(name)
    general = name in BUILT_IN.values()
    owners = [full for full, entry in _registered().items() if entry.value == name and not general]
    if owners and not any(full.startswith(f"{spec.problem}.{spec.role}.") for full in owners):
        raise UnknownNameError(f"{name!r} is no {spec.role} policy of {spec.problem}. {_owner(owners[0])}".rstrip())
    try:
        return getattr(importlib.import_module(module), reference.name)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(f"no policy can be imported from {name!r}: {error}") from error


def _owner(name: str, spec: RoleSpec | None = None) -> str:
    """Whose policy a registered name, or its end, is, as a sentence; empty if it is nobody's.

    Of several with the same end, one of the same problem.
    """
    same = [full for full in _registered() if full == name or full.split(".", 2)[2] == name]
    if not same:
        return ""
    mine = [full for full in same if spec is not None and full.startswith(f"{spec.problem}.")]
    problem, role, short = (mine or same)[0].split(".", 2)
    return f"{short!r} is {_whose(problem, role)}. "


def _checked(policy: Any, name: str, spec: RoleSpec, options: Mapping[str, Any] = MappingProxyType({})) -> Policy:
    """What is built already, if it is a policy of this role; only models still take options."""
    if hasattr(policy, "predict") and hasattr(policy, "observation_space") and MODELS in _registered(SOURCES):
        play = partial(load(_registered(SOURCES)[MODELS]), policy)
        check_policy_options(play, options, _short(name))
        policy = play(spec, **options)
    elif options:
        raise TypeError(f"{name} is built already: it takes no options {', '.join(options)}")
    if not isinstance(policy, Policy):
        raise TypeError(
            f"{name} is not a policy: it has no method predict(observation, state, episode_start, deterministic)"
        )
    own = getattr(policy, "spec", None)
    if isinstance(own, RoleSpec) and (own.problem, own.role) != (spec.problem, spec.role):
        raise ConfigurationError(
            f"{_short(name)} is {_whose(own.problem, own.role)}, not {_whose(spec.problem, spec.role)}"
        )
    check_spaces(policy, name, spec)
    return policy


def check_spaces(policy: Any, name: str, spec: RoleSpec, frames: int = 1) -> None:
    """A model that tells its spaces, as those of stable-baselines3 do, must have those of the role.

    It may see so many observations side by side.

    Raises:
        ConfigurationError: it has others.
    """
    for kind in ("observation_space", "action_space"):
        own = getattr(policy, kind, None)
        if not isinstance(own, spaces.Space) or is_decentralised(policy):
            continue
        wanted = spec.action_space if kind == "action_space" else spec.fields.space()
        shape = wanted.shape or ()
        if kind == "observation_space" and frames > 1:
            shape = (frames * shape[0],)
        if (type(own), own.shape or ()) != (type(wanted), shape):
            raise ConfigurationError(
                f"{_short(name)} has the {kind} {own}, {_whose(spec.problem, spec.role)} here has {wanted}: it was "
                "trained in another configuration, or for another role"
            )


def _whose(problem: str, role: str) -> str:
    return f"{'an' if role == 'attacker' else 'a'} {role} of {problem}"


def _short(name: str) -> str:
    return name if len(name) <= SHOWN else f"{name[:SHOWN]}..."
