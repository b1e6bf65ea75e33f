"""Trained policies on disk: `NAME.safetensors` with the weights and `NAME.json` with the card beside them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes
from safetensors.numpy import save as to_bytes

from agents.files import replacing, write_json
from agents.zoo.card import Card, read_card, require_file
from agents.zoo.network import Network, check_fit, network_of
from agents.zoo.numbers import Numbers, numbers_of
from cps_envs.core.errors import UnknownNameError, near

MOST_BYTES = 256 * 2**20  # of a file of weights
SHIPPED = Path(__file__).with_name("policies")


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


def save(card_path: Path, card: Card, networks: Mapping[int, Network | Numbers]) -> Card:
    """Write weights and card, each whole or not at all; the card comes last. Returns it with their hash."""
    tensors = {
        f"{seed}/{name}": array for seed, network in networks.items() for name, array in network.tensors().items()
    }
    data = to_bytes(tensors)
    with replacing(card_path.with_suffix(".safetensors")) as draft:
        draft.write_bytes(data)
    written = replace(card, weights=hashlib.sha256(data).hexdigest())
    write_json(card_path, written.to_json())
    return written


def load(card_path: Path, seed: int | None = None) -> tuple[Card, Network | Numbers]:
    """The card and the network, or the numbers, of one training seed, the best if none is given. It runs no code.

    Raises:
        ValueError: a damaged file, or a seed that is not in it.
        OSError: a file cannot be read.
    """
    card = read_card(card_path)
    chosen = card.best if seed is None else seed
    if str(chosen) not in card.seeds:
        raise ValueError(f"{card.name} has no training seed {chosen}. Known: {', '.join(card.seeds)}.")
    weights = card_path.with_suffix(".safetensors")
    try:
        require_file(weights, MOST_BYTES)
        data = weights.read_bytes()
        if card.weights and hashlib.sha256(data).hexdigest() != card.weights:
            raise ValueError("these are not the weights that the card was written for")
        tensors = from_bytes(data)
        prefix = f"{chosen}/"
        mine = {name.removeprefix(prefix): array for name, array in tensors.items() if name.startswith(prefix)}
        if card.family:
            return card, numbers_of(mine, len(card.numbers))
        network = network_of(mine, card.activation)
        check_fit(network, card.observation_size, sum(card.actions))
        return card, network
    except (SafetensorError, ValueError) as error:
        raise ValueError(f"{weights} is damaged ({error}). Train or download it again.") from error
