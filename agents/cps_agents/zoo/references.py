"""What lies behind a policy's reference: its card, training seeds, hashes, and the form a network was trained with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cps_agents.zoo.card import Card, read_card
from cps_agents.zoo.code import hash_of, hashes_of_code, hashes_of_files, modules_of_model
from cps_agents.zoo.files import find, read_pair
from cps_envs.core.declare.config import form_fields
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.policies.lookup import parsed, policy_entry, source_entry
from cps_envs.core.policies.reference import Reference
from cps_envs.core.types import ROLES
from cps_envs.registration import find_problem

ZOO, SB3 = "zoo", "sb3"  # sources
PLAYED = ("preset", "overrides", "activation", "head", "decentralised", "observation_size", "actions", "best")


@dataclass(frozen=True)
class Origin:
    """What is known of a policy before it plays."""

    card: Card | None  # of a trained policy
    cards: tuple[Card, ...]  # its own, or those of the trained policies inside it
    seeds: Mapping[int | None, str]  # a reference for each training seed; others stand alone, under None
    sources: Mapping[str, str]  # hashes of trained policies, and of code and models of one's own

    def form(self, config: Any) -> dict[str, Any]:
        """The overrides that give `config` the observation and action form that its policies were trained with.

        Raises:
            ConfigurationError: they were trained in forms that differ.
        """
        return _form(self.cards, config)


def origin_of(problem: str, reference: str) -> Origin:
    """What lies behind a reference. Each file is read once.

    A trained policy stands for all its training seeds, unless the reference names one, and `sb3:FOLDER` for the models
    `FOLDER/seed-N/model.zip`.

    Raises:
        UnknownNameError: a trained policy, model or module that is not there, or a folder without models.
        ConfigurationError: the reference has malformed options.
    """
    tree = parsed(reference)
    if tree.source == SB3 and Path(tree.name).is_dir():
        models = models_in(tree)
        trees = [parsed(model) for model in models.values()]
        return Origin(None, (), models, _sources(problem, trees))
    pairs = {each.name: read_pair(find(each.name)) for each in tree.walk() if each.source == ZOO}
    card = pairs[tree.name][0] if tree.source == ZOO else None
    hashes = {name: _hash_of(*pair) for name, pair in pairs.items()}
    cards = tuple(each for each, _ in pairs.values())
    return Origin(card, cards, _seeds(tree, card), hashes | _sources(problem, [tree]))


def card_of(reference: str) -> Card | None:
    """The card of a trained policy's reference; None for other policies.

    Raises:
        UnknownNameError: there is no such trained policy.
    """
    tree = parsed(reference)
    return read_card(find(tree.name)) if tree.source == ZOO else None


def form_of(reference: str, config: Any) -> dict[str, Any]:
    """The overrides that give `config` the form that a policy, or those of a mixture, were trained with.

    Raises:
        UnknownNameError: there is no such trained policy.
        ConfigurationError: those of a mixture were trained in forms that differ.
    """
    return _form([read_card(find(each.name)) for each in parsed(reference).walk() if each.source == ZOO], config)


def is_trained(reference: str) -> bool:
    """Whether training made a policy, or one of a mixture."""
    return any(each.source in (ZOO, SB3) for each in parsed(reference).walk())


def reference_to(path: Path) -> str:
    """The reference of the trained policy of a card or a training run."""
    reference = f"{ZOO}:{path}"
    return reference if parsed(reference).name == str(path) else f"{reference}/policy.json"


def _form(cards: Iterable[Card], config: Any) -> dict[str, Any]:
    """The form of all of them together, as overrides of `config`."""
    found: dict[str, Any] = {}  # by field, of the whole form
    for card in cards:
        for name, value in _form_of_card(card, config).items():
            if name in found and found[name] != value:
                raise ConfigurationError(
                    f"trained policies of one reference need {name} = {value!r} and {found[name]!r}: they cannot play "
                    "in the same form, so leave one of them out"
                )
            found[name] = value
    return {name: value for name, value in found.items() if value != getattr(config, name)}


def _form_of_card(card: Card, config: Any) -> dict[str, Any]:
    trained = find_problem(card.problem).config(card.preset, card.overrides)
    if type(trained) is not type(config):  # of another problem
        return {}
    form = {name: getattr(trained, name) for name in form_fields(trained, card.role)}
    more = getattr(config, "form_like", None)  # what else of a problem's configuration is form
    return form if more is None else form | more(trained, card.role)


def _seeds(reference: Reference, card: Card | None) -> dict[int | None, str]:
    if card is None or "seed" in reference.options:
        return {None: reference.text}
    return {int(seed): reference.with_option("seed", seed) for seed in card.seeds}


def models_in(reference: Reference) -> dict[int | None, str]:
    """The models of the training seeds in a folder, as references.

    Raises:
        UnknownNameError: it has none.
    """
    folder, query = reference.name, reference.text[len(reference.title) :]
    paths = {path.parent.name.removeprefix("seed-"): path for path in Path(folder).glob("seed-*/model.zip")}
    found = {int(seed): path for seed, path in paths.items() if seed.isdecimal()}
    if not found:
        raise UnknownNameError(f"the folder {folder!r} has no models seed-0/model.zip, seed-1/model.zip, ...")
    return {seed: f"{SB3}:{found[seed]}{query}" for seed in sorted(found)}


def _hash_of(card: Card, data: bytes) -> str:
    """A hash of a trained policy's weights, and of what else of its card says how it plays."""
    how = [getattr(card, name) for name in PLAYED]
    return hashlib.sha256(data + json.dumps([*how, *card.wiring.values()]).encode()).hexdigest()[:16]


def _sources(problem: str, references: Iterable[Reference]) -> dict[str, str]:
    """Hashes of code, models and files of one's own that a problem and references name."""
    found: dict[str, str] = {}
    modules = [problem.partition(":")[0]] if ":" in problem else []
    for each in (inner for reference in references for inner in reference.walk()):
        found |= hashes_of_files(each.options)
        if each.source == SB3:
            path = _model(each.name)
            found[each.title] = hash_of([path])
            modules += modules_of_model(path)
        elif each.source and each.source != ZOO:
            entry = source_entry(each.source)
            modules.append(each.source if entry is None else entry.module)
        elif not each.source:
            entries = (policy_entry(problem, role, each.name.removeprefix(f"{problem}.{role}.")) for role in ROLES)
            modules += [entry.module for entry in entries if entry is not None]
    return found | hashes_of_code(modules)


def _model(name: str) -> Path:
    path = Path(name)
    if not path.is_file():
        raise UnknownNameError(f"there is no file {name!r}: write sb3:PATH, a model that stable-baselines3 saved")
    return path
