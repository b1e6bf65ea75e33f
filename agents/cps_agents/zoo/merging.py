"""Several training seeds of one recipe as one trained policy."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import differing
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import load, save, starts_of
from cps_agents.zoo.network import Network

LIMIT_BYTES = 1_000_000  # of the weights
PLACES = ("--out", "--to", "--jobs", "--meetings")


def merge(cards: Sequence[Path], target: Path) -> Card:
    """Write one card and one file of weights with the seeds of all; the best by validation plays by default.

    Where one of them kept what it was before its first step of learning, the card of all says so.

    Raises:
        CommandError: nothing to merge, different recipes, a seed twice, or weights beyond `LIMIT_BYTES`.
    """
    if not cards:
        raise CommandError("no training runs are named: name their folders, or the folder above them")
    loaded = [load(path) for path in cards]
    first = loaded[0][0]
    networks: dict[int, Network] = {}
    starts: dict[int, Network] = {}
    for path, (card, network) in zip(cards, loaded, strict=True):
        if differing(card.recipe, first.recipe) or card.version != first.version:
            raise CommandError(f"{path} has another recipe than {cards[0]}: put each into its own policy")
        if card.best in networks:
            raise CommandError(f"{path}: training seed {card.best} is already in the policy")
        networks[card.best] = network
        starts |= starts_of(path)
    size = sum(array.nbytes for each in (*networks.values(), *starts.values()) for array in each.tensors().values())
    if size > LIMIT_BYTES:
        raise CommandError(f"the weights take {size:,} bytes, at most {LIMIT_BYTES:,} can be shipped: use fewer seeds")
    seeds = {seed: facts for card, _ in loaded for seed, facts in card.seeds.items()}
    best = max(networks, key=lambda seed: seeds[str(seed)].get("validation", float("-inf")))
    merged = replace(
        first,
        name=target.stem,
        algorithm=next(
            (card.algorithm for card, _ in loaded if card.seeds[str(card.best)].get("steps") == 0), first.algorithm
        ),
        command=without_places(first.command),
        best=best,
        seeds=dict(sorted(seeds.items(), key=lambda entry: int(entry[0]))),
    )
    return save(target, merged, networks, starts)


def without_places(command: str) -> str:
    """A command of `cps-envs train` without what says where files lie and how many processes work."""
    words, kept = iter(shlex.split(command)), []
    for word in words:
        if word in PLACES:
            next(words, None)
        elif word.partition("=")[0] not in (*PLACES, "--resume"):
            kept.append(word)
    return shlex.join(kept)


def cards_below(folder: Path) -> list[Path]:
    """The cards of a run's folder, or of all runs in the folders of a recipe, by seed.

    Raises:
        CommandError: there is none.
    """
    own = folder / "policy.json"
    found = [own] if own.is_file() else sorted(folder.glob("seed-*/policy.json"), key=_seed)
    if not found:
        raise CommandError(f"{folder} has no trained policy: it should be a folder that `cps-envs train` wrote")
    return found


def _seed(path: Path) -> int:
    digits = path.parent.name.removeprefix("seed-")
    return int(digits) if digits.isdigit() else -1
