"""Cards, weights and cells that somebody has edited or damaged."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file, save_file

from cps_agents.arena.meeting import Meeting
from cps_agents.arena.store import Store
from cps_agents.arena.venue import Venue
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_envs import find_problem
from cps_envs.core.types import ROLES, Array
from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.judging import Tally, limited, wrong_numbers
from tools.reliability.fuzz.values import NUMBERS, Generator, odd_value, pick

CARDS, CELLS = 400, 1500  # inputs of a chunk
MOST_BYTES = 4 * 2**20  # of the weights that are tried


def cards(chunk: Chunk, tally: Tally) -> None:
    """A shipped policy with an edited card or damaged weights plays a step, or is refused."""
    rng = np.random.default_rng([chunk.number, 6])
    names = [name for name in shipped_names() if _size(name) < MOST_BYTES]
    name = names[chunk.number % len(names)]
    card = read_card(SHIPPED / f"{name}.json")
    problem = find_problem(card.problem)
    rival = ROLES[1 - ROLES.index(card.role)]
    config = problem.config(card.preset, card.overrides)
    here = Path("policy.json")

    def play() -> str | None:
        game = problem.match(config, 2, {card.role: f"zoo:{here.resolve()}"})  # type: ignore[dict-item]
        envs = np.ones(2, np.bool_)
        game.reset(envs, [np.random.default_rng(b) for b in range(2)])
        neutral = np.stack([game.game.neutral_action[rival]] * 2)
        paid = game.step({rival: neutral}, envs, game.game.decision_interval[rival])
        return wrong_numbers(game.game.observe(rival), paid)

    for _ in range(CARDS):
        what = _spoil_policy(name, here, rng)
        tally.attempt(f"{name}: {what}", limited(play))


def _size(name: str) -> int:
    return (SHIPPED / f"{name}.safetensors").stat().st_size


def _spoil_policy(name: str, here: Path, rng: Generator) -> str:
    """Put a damaged copy of a shipped policy to `here`; says what was done to it."""
    weights = here.with_suffix(".safetensors")
    document = json.loads((SHIPPED / f"{name}.json").read_text(encoding="utf-8"))
    document["weights"] = ""  # else the hash alone would find each change
    shutil.copyfile(SHIPPED / weights_of(name), weights)
    if rng.random() < 0.5:
        what = _spoil_tensors(weights, rng) if rng.random() < 0.8 else _spoil_bytes(weights, rng)
        here.write_text(json.dumps(document), encoding="utf-8")
    else:
        what = _spoil_document(document, rng)
        _write(here, document, rng)
    return what


def weights_of(name: str) -> str:
    """The file of a shipped policy's weights."""
    return f"{name}.safetensors"


def _spoil_document(document: Any, rng: Generator) -> str:
    """Change an entry of JSON data, at any depth, in place."""
    holder, path = document, []
    while True:
        keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = pick(keys, rng)
        path.append(str(key))
        inner = holder[key]
        if not (isinstance(inner, (dict, list)) and inner and rng.random() < 0.7):
            break
        holder = inner
    if rng.random() < 0.15:
        del holder[key]
        return f"without {'.'.join(path)}"
    what, value = odd_value(rng)
    holder[key] = value if isinstance(value, (int, float, str, bool, list, dict, type(None))) else what
    return f"{'.'.join(path)} = {what}"


def _write(path: Path, document: Any, rng: Generator) -> None:
    """Write JSON; sometimes cut off, or nested too deeply."""
    try:
        text = json.dumps(document)
    except (RecursionError, ValueError, TypeError):
        text = "[" * 100_000
    kind = rng.random()
    if kind < 0.05:
        text = text[: rng.integers(len(text) + 1)]
    elif kind < 0.08:
        text = text[:-1] + ', "deep": ' + "[" * 100_000
    path.write_text(text, encoding="utf-8", errors="surrogatepass")


def _spoil_bytes(path: Path, rng: Generator) -> str:
    data = bytearray(path.read_bytes())
    if rng.random() < 0.5:
        path.write_bytes(bytes(data[: rng.integers(len(data))]))
        return "weights cut off"
    for place in rng.integers(min(len(data), 2000), size=3).tolist():  # mostly the header
        data[place] = int(rng.integers(256))
    path.write_bytes(bytes(data))
    return "bytes of the weights changed"


def _spoil_tensors(path: Path, rng: Generator) -> str:
    tensors = load_file(path)
    name = list(tensors)[rng.integers(len(tensors))]
    change = pick(TENSORS, rng)
    changed = change(tensors.pop(name), rng)
    if changed is not None:
        tensors[name] = np.ascontiguousarray(changed)
    save_file(tensors, path)
    return f"{name}: {change.__name__.strip('_')}"


def _gone(array: Array, rng: Generator) -> None:
    return None


def _set_entry(array: Array, rng: Generator) -> Array:
    changed = array.copy()
    number = pick(NUMBERS, rng)
    with np.errstate(all="ignore"):
        changed.flat[rng.integers(changed.size)] = np.float64(number).astype(array.dtype)
    return changed


def _shift(array: Array, rng: Generator) -> Array:
    return (array + int(rng.integers(-1000, 1000))).astype(array.dtype)


def _longer(array: Array, rng: Generator) -> Array:
    return np.concatenate([array] * int(rng.integers(2, 50)))


def _shorter(array: Array, rng: Generator) -> Array:
    return array[: rng.integers(len(array))] if array.ndim else array


def _retyped(array: Array, rng: Generator) -> Array:
    kinds = ("f2", "f8", "i1", "i4", "i8", "u1", "?")
    with np.errstate(all="ignore"):
        return array.astype(pick(kinds, rng))


def _reshaped(array: Array, rng: Generator) -> Array:
    forms = (array.T, array[np.newaxis], array.reshape(-1), array[..., np.newaxis])
    return np.asarray(pick(forms, rng))


TENSORS: Sequence[Callable[[Array, Generator], Array | None]] = (
    _gone,
    _set_entry,
    _set_entry,
    _shift,
    _longer,
    _shorter,
    _retyped,
    _reshaped,
)


def cells(chunk: Chunk, tally: Tally) -> None:
    """An edited result of a finished pair is not taken: it is played again. Taking an edited one would be nonsense."""
    rng = np.random.default_rng([chunk.number, 7])
    job = Meeting(Venue("rogue", "paper", {"duration_s": 4.0}), "none", "none", 2)
    store = Store(Path("cells"))
    result = {"metrics": {"return": [1.5, 2.5]}}
    store.put(job, result)
    file = next(store.folder.glob("*.json"))
    sound = file.read_text(encoding="utf-8")

    def look() -> str | None:
        taken = store.get(job)
        if taken is None:
            raise ValueError("played again")  # which is the refusal of a store
        return None if taken == result else f"taken: {taken}"

    for _ in range(CELLS):
        document = json.loads(sound)
        what = _spoil_document(document, rng)
        _write(file, document, rng)
        tally.attempt(what, look)
