"""What lies behind a policy's reference: training seeds, files, and the action form a network was trained with."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from cps_agents.zoo.card import Card, read_card
from cps_agents.zoo.files import find, read_pair
from cps_envs.core.declare.config import form_fields
from cps_envs.core.errors import UnknownNameError
from cps_envs.registration import find_problem

PREFIX, SB3 = "zoo:", "sb3:"
NAMED = re.compile(r'zoo:([^?"&,\]]+)')  # also inside mixture?policies=["zoo:..."]
TRAINED = re.compile(r'(^|")(zoo|sb3):')


def card_of(reference: str) -> Card | None:
    """The card of a trained policy's reference; None for other policies.

    Raises:
        UnknownNameError: there is no such trained policy.
    """
    name = reference.partition("?")[0]
    return read_card(find(name.removeprefix(PREFIX))) if name.startswith(PREFIX) else None


def by_training_seed(reference: str) -> dict[int | None, str]:
    """A reference for each training seed of a trained policy, unless it names one itself; others stand alone.

    `sb3:FOLDER` stands for the models `FOLDER/seed-N/model.zip` of all training seeds.
    """
    name, _, query = reference.partition("?")
    if name.startswith(SB3) and Path(name.removeprefix(SB3)).is_dir():
        return _models(name.removeprefix(SB3), f"?{query}" if query else "")
    card = card_of(reference)
    if card is None or any(part.startswith("seed=") for part in query.split("&")):
        return {None: reference}
    joint = "&" if query else "?"
    return {int(seed): f"{reference}{joint}seed={seed}" for seed in card.seeds}


def _models(folder: str, query: str) -> dict[int | None, str]:
    found = {int(path.parent.name.removeprefix("seed-")): path for path in Path(folder).glob("seed-*/model.zip")}
    if not found:
        raise UnknownNameError(f"the folder {folder!r} has no models seed-0/model.zip, seed-1/model.zip, ...")
    return {seed: f"{SB3}{found[seed]}{query}" for seed in sorted(found)}


def is_trained(reference: str) -> bool:
    """Whether training made a policy, or one of a mixture."""
    return bool(TRAINED.search(reference))


def is_missing(reference: str) -> bool:
    """Whether a reference names a trained policy that is not there."""
    return not all(map(_exists, NAMED.findall(reference)))


def weights_of(reference: str) -> dict[str, str]:
    """Hashes of the trained policies in a reference, weights and how they play: results hold as long as these stay."""
    found: dict[str, str] = {}
    for name in filter(_exists, dict.fromkeys(NAMED.findall(reference))):
        card, data = read_pair(find(name))
        digest = hashlib.sha256(data)
        digest.update(repr(replace(card, evaluation={}, command="", versions={})).encode())
        found[name] = digest.hexdigest()[:16]
    return found


def form_of(reference: str, config: Any) -> dict[str, Any]:
    """The overrides that give `config` the observation and action form a trained policy was trained with."""
    card = card_of(reference) if not is_missing(reference) else None
    if card is None:
        return {}
    trained = find_problem(card.problem).config(card.preset, card.overrides)
    if type(trained) is not type(config):  # of another problem
        return {}
    names = form_fields(trained, card.role)
    form = {name: getattr(trained, name) for name in names if getattr(trained, name) != getattr(config, name)}
    if (card.problem, card.role) == ("fdi", "attacker") and trained.tasks and not config.tasks:
        form["tasks"] = str(config.fixed_task)  # the same task, told by the observation
    return form


def _exists(name: str) -> bool:
    try:
        find(name)
    except UnknownNameError:
        return False
    return True
