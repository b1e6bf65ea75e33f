"""Hashes of what a result depends on: our code and data, trained networks, and code of one's own."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import cps_agents.zoo
import cps_baselines
import cps_envs
from cps_agents.zoo.card import SHIPPED
from cps_agents.zoo.references import weights_of
from cps_envs import PROBLEMS
from cps_envs.core.policies.lookup import policy_entry
from cps_envs.core.types import ROLES

DATA = ("*.py", "*.json", "*.csv")
DECLARATIONS = ("benchmark.py", "searches.py", "tracks.py")  # what is played, which each piece of work tells itself
COVERED = ("cps_envs", "cps_baselines", "zoo", "sb3")  # by the fingerprint, or told apart
CODE = re.compile(r'(?:^|")([A-Za-z_][\w.]*):[A-Za-z_]')  # module:attribute, also inside a mixture
MODEL = re.compile(r'(?:^|")sb3:([^?"]+)')


@lru_cache
def fingerprint(problem: str) -> str:
    """A hash of the code and the data that a problem's results depend on, without the trained networks.

    The registered problems know nothing of one another, so a change in one leaves the results of the others valid.
    """
    others = set(PROBLEMS) - {problem} if problem in PROBLEMS else set()
    digest = hashlib.sha256()
    for package in (cps_envs, cps_baselines, cps_agents.zoo):
        root = Path(next(iter(package.__path__)))
        found = (file for pattern in DATA for file in root.rglob(pattern))
        for file in sorted(file for file in found if not file.is_relative_to(SHIPPED)):
            place = file.relative_to(root)
            if place.parts[0] in others or place.name in DECLARATIONS:
                continue
            digest.update(place.as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def sources_of(problem: str, *references: str) -> dict[str, str]:
    """Hashes of what a result depends on beside our own code: trained policies, and code and models of one's own."""
    found: dict[str, str] = {}
    modules = CODE.findall(problem)
    for reference in references:
        found |= weights_of(reference)
        found |= {f"sb3:{name}": _hash([Path(name)]) for name in MODEL.findall(reference)}
        modules += [*CODE.findall(reference), *_registered(problem, reference)]
    own = dict.fromkeys(map(_unit, modules))
    return found | {name: _hash(_files(name)) for name in own if name.partition(".")[0] not in COVERED}


def _registered(problem: str, reference: str) -> list[str]:
    """The modules that a registered name stands for."""
    entries = [policy_entry(problem, role, reference.partition("?")[0]) for role in ROLES]
    return [entry.module for entry in entries if entry is not None]


def _unit(module: str) -> str:
    """What is hashed for a module: the whole package that it is in, of ours the module alone."""
    top = module.partition(".")[0]
    return module if top == "cps_agents" else top


def _files(unit: str) -> list[Path]:
    """The Python files of a module or package; a top-level one is found without being imported."""
    try:
        spec = find_spec(unit)
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    if folders := spec.submodule_search_locations:
        return sorted(file for folder in folders for file in Path(folder).rglob("*.py"))
    return [Path(spec.origin)] if spec.origin is not None else []


def _hash(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        if file.is_file():
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
