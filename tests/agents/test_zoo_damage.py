"""Cards and weights from strangers: they play, or are refused with a sentence that names the file."""

from __future__ import annotations

import json
import os
import struct
import sys
import threading
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

from cps_agents.zoo.card import MOST_BYTES, SHIPPED, read_card
from cps_agents.zoo.files import load, shipped_names
from cps_agents.zoo.network import Network, network_of
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.types import Array
from tests.agents.command_line import succeeded
from tests.agents.trained import save_tiny

Tensors: TypeAlias = dict[str, Array]


def changed(name: str, change: Callable[[Array], Array]) -> Callable[[Tensors], None]:
    def apply(tensors: Tensors) -> None:
        tensors[name] = np.ascontiguousarray(change(tensors[name]))

    return apply


def narrowed(tensors: Tensors) -> None:
    for name in ("0/layer.0.weight", "0/layer.0.bias", "0/log_deviation"):
        tensors[name] = np.ascontiguousarray(tensors[name][..., :3])


def without(tensors: Tensors, part: str) -> None:
    for name in [name for name in tensors if part in name]:
        del tensors[name]


def entry(value: float) -> Callable[[Array], Array]:
    def put(array: Array) -> Array:
        result = array.copy()
        result.flat[0] = value
        return result

    return put


WEIGHTS: dict[str, Callable[[Tensors], None]] = {
    "columns beyond": changed("0/columns", lambda array: array + 1000),
    "columns negative": changed("0/columns", lambda array: array - 5),
    "columns of numbers": changed("0/columns", lambda array: array.astype(np.float64)),
    "columns scalar": changed("0/columns", lambda array: array[0]),
    "no columns": changed("0/columns", lambda array: array[:0]),
    "double weights": changed("0/layer.0.weight", lambda array: array.astype(np.float64)),
    "whole weights": changed("0/layer.0.weight", lambda array: array.astype(np.int8)),
    "weights of rank 3": changed("0/layer.0.weight", lambda array: array[..., None]),
    "huge weight": changed("0/layer.0.weight", entry(3e38)),
    "weight not a number": changed("0/layer.0.weight", entry(np.nan)),
    "mean infinite": changed("0/mean", entry(np.inf)),
    "deviation zero": changed("0/deviation", entry(0.0)),
    "deviation negative": changed("0/deviation", lambda array: -array),
    "spread of wrong length": changed("0/log_deviation", lambda array: array[:-1]),
    "spread huge": changed("0/log_deviation", entry(800.0)),
    "fewer outputs": lambda tensors: narrowed(tensors),
    "no layers": lambda tensors: without(tensors, "layer"),
}
CARDS: dict[str, dict[str, Any]] = {
    "actions negative": {"actions": [-5]},
    "actions huge": {"actions": [10**30]},
    "actions text": {"actions": ["a"]},
    "no actions": {"actions": []},
    "best text": {"best": "x"},
    "size not a number": {"observation_size": float("nan")},
    "version text": {"version": "0"},
    "overrides list": {"overrides": [1]},
    "problem list": {"problem": ["hvac"]},
    "unknown entry": {"surprise": 1},
}


@pytest.fixture
def card(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.json"
    save_tiny(path, "fdi", "attacker", seeds=1)
    return path


def rewrite(card: Path, tensors: Tensors) -> None:
    """Other weights, of which the card knows no hash."""
    save_file(tensors, card.with_suffix(".safetensors"))
    card.write_text(json.dumps({**json.loads(card.read_text()), "weights": ""}))


@pytest.mark.parametrize("name", WEIGHTS)
def test_weights_that_make_no_sense_are_refused(name: str, card: Path) -> None:
    tensors = load_file(card.with_suffix(".safetensors"))
    rewrite(card, tensors)
    load(card)
    WEIGHTS[name](tensors)
    rewrite(card, tensors)
    with pytest.raises(ValueError, match=r"tiny\.safetensors is damaged .*Train or download it again"):
        load(card)


@pytest.mark.parametrize("name", CARDS)
def test_cards_that_make_no_sense_are_refused(name: str, card: Path) -> None:
    card.write_text(json.dumps({**json.loads(card.read_text()), **CARDS[name]}))
    with pytest.raises(ValueError, match=r"tiny\.json is no card of a trained policy .*Train or download it again"):
        load(card)


def test_weights_of_another_policy_are_refused(card: Path, tmp_path: Path) -> None:
    save_tiny(tmp_path / "other.json", "fdi", "attacker", seeds=2)
    card.with_suffix(".safetensors").write_bytes((tmp_path / "other.safetensors").read_bytes())
    with pytest.raises(ValueError, match="not the weights that the card was written for"):
        load(card)


HEADER = json.dumps({"0/columns": {"dtype": "I64", "shape": [2**40], "data_offsets": [0, 2**43]}}).encode()
ODD: dict[str, Callable[[Path, Path], object]] = {  # card, weights
    "deep": lambda card, _: card.write_text('{"a":' * 100_000),
    "large": lambda card, _: card.write_text(f'{{"name": "{"a" * MOST_BYTES}"}}'),
    "nearly empty": lambda card, _: card.write_text('{"name": "tiny"}'),
    "endless header": lambda _, weights: weights.write_bytes(struct.pack("<Q", 2**63) + weights.read_bytes()[8:]),
    "huge array": lambda _, weights: weights.write_bytes(struct.pack("<Q", len(HEADER)) + HEADER + bytes(64)),
    "nonsense": lambda _, weights: weights.write_bytes(b"nonsense"),
    "cut": lambda _, weights: weights.write_bytes(weights.read_bytes()[:-100]),
    "gone": lambda _, weights: weights.unlink(),
    "folder": lambda _, weights: (weights.unlink(), weights.mkdir()),
    "pipe": lambda card, _: (card.unlink(), os.mkfifo(card)),
}


@pytest.mark.parametrize("kind", [kind for kind in ODD if kind != "pipe" or hasattr(os, "mkfifo")])
def test_files_that_are_none_or_claim_too_much_are_refused(kind: str, card: Path) -> None:
    document = {**json.loads(card.read_text()), "weights": ""}
    card.write_text(json.dumps(document))
    ODD[kind](card, card.with_suffix(".safetensors"))
    with pytest.raises((ValueError, OSError), match="tiny"):
        load(card)


def test_hidden_files_are_no_policies(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "fdi", "attacker")
    (tmp_path / ".tiny.4242.json").write_text("{")
    assert shipped_names(tmp_path) == ["tiny"]


def test_shipped_cards_tell_their_weights() -> None:
    assert all(len(read_card(SHIPPED / f"{name}.json").weights) == 64 for name in shipped_names())


@given(st.data())
def test_what_is_accepted_plays_finite_numbers(data: st.DataObject) -> None:
    """Any network that passes the checks gives finite outputs for any observation in [-1, 1]."""
    tensors = {
        "columns": np.arange(3),
        "mean": data.draw(numbers(3)),
        "deviation": np.abs(data.draw(numbers(3))) + np.float32(1e-6),
        "layer.0.weight": data.draw(numbers(3 * 2)).reshape(3, 2),
        "layer.0.bias": data.draw(numbers(2)),
    }
    network: Network = network_of(tensors, "tanh")
    outputs = network.forward(np.array([[-1.0, 0.3, 1.0]], np.float32))
    assert np.isfinite(outputs).all()


def numbers(count: int) -> st.SearchStrategy[Array]:
    entries = st.floats(-1e6, 1e6, width=32)
    return st.lists(entries, min_size=count, max_size=count).map(lambda row: np.array(row, np.float32))


class KilledError(Exception):
    """In place of a kill: nothing is cleaned up after it."""


def killed(*arguments: object) -> None:
    raise KilledError


def seeds_in(card: Path) -> list[str]:
    """The training seeds of what plays now, whose weights belong to the card."""
    return list(load(card)[0].seeds)


def test_a_kill_before_the_card_leaves_the_old_policy(card: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr("cps_agents.zoo.files.write_json", killed)
        with pytest.raises(KilledError):
            save_tiny(card, "fdi", "attacker", seeds=3)
    assert seeds_in(card) == ["0"]
    document = {**json.loads(card.read_text()), "weights": ""}  # of an old card, which names no weights
    card.write_text(json.dumps(document))
    assert seeds_in(card) == ["0"]
    save_tiny(card, "fdi", "attacker", seeds=2)
    assert seeds_in(card) == ["0", "1"]


@pytest.mark.parametrize("first", [False, True])
def test_a_kill_after_the_card_leaves_the_new_policy(
    first: bool, card: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    card = tmp_path / "other.json" if first else card
    with monkeypatch.context() as patched:
        patched.setattr("cps_agents.zoo.files.os.replace", replacing_all_but(card.with_suffix(".safetensors")))
        with pytest.raises(KilledError):
            save_tiny(card, "fdi", "attacker", seeds=3)
    assert seeds_in(card) == ["0", "1", "2"]
    with monkeypatch.context() as patched:  # and once more, before the next card
        patched.setattr("cps_agents.zoo.files.write_json", killed)
        with pytest.raises(KilledError):
            save_tiny(card, "fdi", "attacker", seeds=4)
    assert seeds_in(card) == ["0", "1", "2"]
    save_tiny(card, "fdi", "attacker", seeds=2)
    assert seeds_in(card) == ["0", "1"]
    assert shipped_names(tmp_path) == (["other", "tiny"] if first else ["tiny"])


def replacing_all_but(last: Path) -> Callable[[Path, Path], None]:
    replace = os.replace

    def put(draft: Path, path: Path) -> None:
        if Path(path) == last:
            raise KilledError
        replace(draft, path)

    return put


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be replaced there")
def test_a_reader_always_finds_a_pair_that_fits(card: Path) -> None:
    counts = (1, 2, 3, 4) * 5
    writer = threading.Thread(target=lambda: [save_tiny(card, "fdi", "attacker", seeds=count) for count in counts])
    writer.start()
    found = set()
    while writer.is_alive():
        found.add(len(seeds_in(card)))
    writer.join()
    assert found <= {1, 2, 3, 4}
    assert len(seeds_in(card)) == 4


@pytest.mark.parametrize("command", ["show", "card", "list"])
def test_a_card_cannot_write_to_the_terminal(command: str, tmp_path: Path) -> None:
    path = tmp_path / "evil.json"
    save_tiny(path, "rogue", "defender", seeds=1)
    content = json.loads(path.read_text())
    texts = {"algorithm": "\x1b]0;owned\x07\x1b[2Jppo\x9b2J", "opponent": "[/] [link=x]y", "command": "a\u202eb\rc[/x]"}
    path.write_text(json.dumps({**content, **texts, "recipe": {"\x1bkey": "\x1b[31m"}}))
    arguments = ("list", "--folder", str(tmp_path)) if command == "list" else (command, str(path))
    result = succeeded("zoo", *arguments, columns=300)
    assert not any(unicodedata.category(letter) == "Cc" for letter in result.output.replace("\n", ""))
    assert "\u202e" not in result.output
    assert "[/] [link=x]y" in result.output


@pytest.mark.parametrize(
    "change",
    [
        {"seeds": {"0": None}},
        {"seeds": {"0": {"steps": "x"}}},
        {"seeds": {"0": {"validation": None}}},
        {"seeds": {"0": {"steps": 10**400}}},
        {"seeds": {"0": {}, "x y": {}}},
        {"evaluation": {"a": "b"}},
        {"evaluation": {"a": {"row": {"mean": [1], "metric": "return"}}}},
        {"evaluation": {"a": {"row": {"mean": 1.0}}}},
        {"evaluation": {"a": {"row": {"mean": 1.0, "metric": "return", "low": "x", "high": 1}}}},
        {"versions": {"a": 1}},
    ],
)
def test_entries_inside_a_card_are_checked_too(change: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "tiny.json"
    save_tiny(path, "rogue", "attacker")
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(DamagedFileError, match="Train or download it again"):
        read_card(path)
