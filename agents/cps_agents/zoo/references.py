"""What lies behind a policy's reference: its card, training seeds, hashes, and the form a network was trained with."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cps_agents.zoo.card import Card, read_card
from cps_agents.zoo.files import find, read_pair
from cps_envs.core.declare.config import form_fields
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.policies.lookup import policy_entry
from cps_envs.core.types import ROLES
from cps_envs.registration import find_problem

PREFIX, SB3 = "zoo:", "sb3:"
NAMED = re.compile(r'zoo:([^?"&,\]]+)')  # also inside mixture?policies=["zoo:..."]
MODEL = re.compile(r'(?:^|")sb3:([^?"]+)')
CODE = re.compile(r'(?:^|")([A-Za-z_][\w.]*):[A-Za-z_]')  # module:attribute, also inside a mixture
TRAINED = re.compile(r'(^|")(zoo|sb3):')
COVERED = ("cps_envs", "cps_baselines", "zoo", "sb3")  # by the hash of our own code, or told apart
PLAYED = ("preset", "overrides", "activation", "head", "decentralised", "observation_size", "actions", "best")


@dataclass(frozen=True)
class Origin:
    """What is known of a policy before it plays."""

    card: Card | None  # of a trained policy that is there
    seeds: Mapping[int | None, str]  # a reference for each training seed; others stand alone, under None
    sources: Mapping[str, str]  # hashes of trained policies, and of code and models of one's own

    def form(self, config: Any) -> dict[str, Any]:
        """The overrides that give `config` the observation and action form that the policy was trained with."""
        return _form(self.card, config)


def origin_of(problem: str, reference: str) -> Origin:
    """What lies behind a reference. Each file is read once; a trained policy that is not there has no card.

    A trained policy stands for all its training seeds, unless the reference names one, and `sb3:FOLDER` for the models
    `FOLDER/seed-N/model.zip`.

    Raises:
        UnknownNameError: a folder without models.
    """
    name, _, query = reference.partition("?")
    if name.startswith(SB3) and Path(name.removeprefix(SB3)).is_dir():
        models = _models(name.removeprefix(SB3), f"?{query}" if query else "")
        return Origin(None, models, _sources(problem, models.values()))
    pairs = {each: read_pair(path) for each in NAMED.findall(reference) if (path := _place(each)) is not None}
    card = pairs[named][0] if (named := name.removeprefix(PREFIX)) in pairs and named != name else None
    hashes = {each: _hash_of(*pair) for each, pair in pairs.items()}
    return Origin(card, _seeds(reference, card), hashes | _sources(problem, [reference]))


def card_of(reference: str) -> Card | None:
    """The card of a trained policy's reference; None for other policies.

    Raises:
        UnknownNameError: there is no such trained policy.
    """
    name = reference.partition("?")[0]
    return read_card(find(name.removeprefix(PREFIX))) if name.startswith(PREFIX) else None


def form_of(reference: str, config: Any) -> dict[str, Any]:
    """The overrides that give `config` the form a policy was trained with; none for one that is not there."""
    try:
        return _form(card_of(reference), config)
    except UnknownNameError:
        return {}


def hash_of_code(text: str) -> str:
    """A hash of the module or package that a text `module:attribute` names."""
    return _hash(_files(_unit(text.partition(":")[0])))


def is_trained(reference: str) -> bool:
    """Whether training made a policy, or one of a mixture."""
    return bool(TRAINED.search(reference))


def _form(card: Card | None, config: Any) -> dict[str, Any]:
    if card is None:
        return {}
    trained = find_problem(card.problem).config(card.preset, card.overrides)
    if type(trained) is not type(config):  # of another problem
        return {}
    names = form_fields(trained, card.role)
    form = {name: getattr(trained, name) for name in names if getattr(trained, name) != getattr(config, name)}
    more = getattr(config, "form_like", None)  # what else of a problem's configuration is form
    return form if more is None else form | more(trained, card.role)


def _seeds(reference: str, card: Card | None) -> dict[int | None, str]:
    query = reference.partition("?")[2]
    if card is None or any(part.startswith("seed=") for part in query.split("&")):
        return {None: reference}
    return {int(seed): f"{reference}{'&' if query else '?'}seed={seed}" for seed in card.seeds}


def _models(folder: str, query: str) -> dict[int | None, str]:
    found = {int(path.parent.name.removeprefix("seed-")): path for path in Path(folder).glob("seed-*/model.zip")}
    if not found:
        raise UnknownNameError(f"the folder {folder!r} has no models seed-0/model.zip, seed-1/model.zip, ...")
    return {seed: f"{SB3}{found[seed]}{query}" for seed in sorted(found)}


def _place(name: str) -> Path | None:
    """Where a trained policy's card is; None where there is none."""
    try:
        return find(name)
    except UnknownNameError:
        return None


def _hash_of(card: Card, data: bytes) -> str:
    """A hash of a trained policy's weights, and of what else of its card says how it plays."""
    how = [getattr(card, name) for name in PLAYED]
    return hashlib.sha256(data + json.dumps([*how, *card.wiring.values()]).encode()).hexdigest()[:16]


def _sources(problem: str, references: Iterable[str]) -> dict[str, str]:
    """Hashes of code and models of one's own that a problem and references name."""
    models: list[str] = []
    modules = CODE.findall(problem)
    for reference in references:
        models += MODEL.findall(reference)
        entries = [policy_entry(problem, role, reference.partition("?")[0]) for role in ROLES]
        modules += [*CODE.findall(reference), *(entry.module for entry in entries if entry is not None)]
    own = dict.fromkeys(map(_unit, modules))
    found = {f"{SB3}{name}": _hash([Path(name)]) for name in models}
    return found | {name: _hash(_files(name)) for name in own if name.partition(".")[0] not in COVERED}


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
