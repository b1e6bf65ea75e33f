"""Trained policies on disk: `NAME.safetensors` with the weights and `NAME.json` with the card beside them."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes
from safetensors.numpy import save as to_bytes

from cps_agents.files import alone_at, replacing, write_json
from cps_agents.zoo.card import REMEDY, SHIPPED, Card, read_card
from cps_agents.zoo.network import Network, check_fit, network_of
from cps_envs.core.documents import read_bytes
from cps_envs.core.errors import UnknownNameError, near

MOST_BYTES = 256 * 2**20  # of a file of weights
WEIGHTS = ".safetensors"
WAIT_S = 10.0  # for another process that writes the same policy
ATTEMPTS = 3  # to read card and weights that fit, while another process may be writing them
START = "start/"  # before the training seed, in the names of the weights before any training


def shipped_names(folder: Path = SHIPPED) -> list[str]:
    """Names of the policies in a folder, by default those that come with the package."""
    return sorted(path.stem for path in folder.glob("*.json") if not path.name.startswith("."))


def find(name: str) -> Path:
    """The card of a shipped policy's name, of a card's path, or of a folder with one card (of a training run).

    Raises:
        UnknownNameError: there is none.
    """
    path = Path(name)
    if name in shipped_names():
        return SHIPPED / f"{name}.json"
    if path.suffix in (".json", ".safetensors") and path.with_suffix(".json").is_file():
        return path.with_suffix(".json")
    inside = path / "policy.json"
    if inside.is_file():
        return inside
    raise UnknownNameError(
        f"there is no trained policy {name!r}: neither shipped, nor a card's file, nor the folder of a training run "
        f"(with policy.json). {near(name, shipped_names())}"
    )


def save(
    card_path: Path,
    card: Card,
    networks: Mapping[int, Network],
    starts: Mapping[int, Network] | None = None,
) -> Card:
    """Write weights and card so that at every moment a pair that fits is there. Returns the card with their hash.

    `networks` has those of each training seed, `starts` the same before any training, where they are known.

    New weights wait beside the old ones until the card that names their hash is there. Whoever is killed in between
    leaves the old policy, or the new one.

    Raises:
        CommandError: another command goes on writing this policy.
        OSError: a file cannot be written.
    """
    kept = {f"{seed}/": network for seed, network in networks.items()}
    kept |= {f"{START}{seed}/": network for seed, network in (starts or {}).items()}
    data = to_bytes(
        {f"{prefix}{name}": array for prefix, network in kept.items() for name, array in network.tensors().items()}
    )
    written = replace(card, weights=hashlib.sha256(data).hexdigest())
    with alone_at(card_path, wait_s=WAIT_S):
        _settle(card_path)
        with replacing(_waiting(card_path)) as draft:
            draft.write_bytes(data)
        write_json(card_path, written.to_json())
        _settle(card_path)
    return written


def load(name: str | Path, seed: int | None = None, *, untrained: bool = False) -> tuple[Card, Network]:
    """The card and the network of one training seed, the best if none is given. It runs no code.

    `name` is what `find` takes, or the path of a card.

    With `untrained` the network is the one that this training began with.

    Raises:
        UnknownNameError: there is no such policy.
        ValueError: a damaged file, a seed that is not in it, or no untrained network in it.
        OSError: a file cannot be read.
    """
    card_path = find(name) if isinstance(name, str) else name
    card, data = read_pair(card_path)
    chosen = card.best if seed is None else seed
    if str(chosen) not in card.seeds:
        raise ValueError(f"{card.name} has no training seed {chosen}. Known: {', '.join(card.seeds)}.")
    try:
        tensors = from_bytes(data)
    except SafetensorError as error:
        raise _damaged(card_path, error) from error
    if untrained and not any(name.startswith(f"{START}{chosen}/") for name in tensors):
        raise ValueError(f"{card.name} was saved without the network that its training began with")
    try:
        prefix = f"{START}{chosen}/" if untrained else f"{chosen}/"
        mine = {name.removeprefix(prefix): array for name, array in tensors.items() if name.startswith(prefix)}
        network = network_of(mine, card.activation)
        check_fit(network, card.observation_size, sum(card.actions))
        return card, network
    except ValueError as error:
        raise _damaged(card_path, error) from error


def starts_of(card_path: Path) -> dict[int, Network]:
    """The untrained networks of a file, by training seed.

    Raises:
        ValueError: a damaged file.
        OSError: a file cannot be read.
    """
    card, data = read_pair(card_path)
    try:
        names = from_bytes(data).keys()
    except SafetensorError as error:
        raise _damaged(card_path, error) from error
    seeds = [int(seed) for seed in card.seeds if any(name.startswith(f"{START}{seed}/") for name in names)]
    found = {seed: load(card_path, seed, untrained=True)[1] for seed in seeds}
    return {seed: network for seed, network in found.items() if isinstance(network, Network)}


def read_pair(card_path: Path) -> tuple[Card, bytes]:
    """A card and the content of the file with its weights.

    Raises:
        ValueError: the card is damaged, or the weights are not those that it was written for.
        OSError: a file cannot be read.
    """
    for attempts_left in reversed(range(ATTEMPTS)):
        card = read_card(card_path)
        try:
            return card, _weights_for(card, card_path)
        except (ValueError, FileNotFoundError) as error:
            if attempts_left:
                continue  # another policy may have been written between the two looks
            if isinstance(error, ValueError):
                raise _damaged(card_path, error) from error
            raise
    raise AssertionError("the last attempt returns or raises")


def _weights_for(card: Card, card_path: Path) -> bytes:
    """The weights, in their place or waiting for it, that have the card's hash; a card without one takes any."""
    waiting = _waiting(card_path)
    if card.weights and waiting.is_file() and _fits(data := read_bytes(waiting, MOST_BYTES), card):
        return data
    data = read_bytes(card_path.with_suffix(WEIGHTS), MOST_BYTES)
    if card.weights and not _fits(data, card):
        raise ValueError("these are not the weights that the card was written for")
    return data


def _settle(card_path: Path) -> None:
    """Give waiting weights their place if the card is there that they were written for."""
    waiting = _waiting(card_path)
    if not (waiting.is_file() and card_path.is_file()):
        return
    with suppress(ValueError):  # a damaged card is about to be replaced
        if _fits(read_bytes(waiting, MOST_BYTES), read_card(card_path)):
            os.replace(waiting, card_path.with_suffix(WEIGHTS))


def _waiting(card_path: Path) -> Path:
    return card_path.with_name(f".{card_path.stem}.waiting{WEIGHTS}")


def _fits(data: bytes, card: Card) -> bool:
    return hashlib.sha256(data).hexdigest() == card.weights


def _damaged(card_path: Path, error: Exception) -> ValueError:
    return ValueError(f"{card_path.with_suffix(WEIGHTS)} is damaged ({error}). {REMEDY}")
