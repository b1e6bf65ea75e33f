"""All that a `Learner` has to remember between two updates, as arrays by name, for a file that runs no code.

Between two starts of all episodes that includes how the running ones came where they are.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes
from safetensors.numpy import save as to_bytes

from cps_agents.errors import CommandError
from cps_agents.files import replacing
from cps_agents.learning.ppo import Learner
from cps_envs.core.documents import read_bytes
from cps_envs.core.types import Array

MOST_BYTES = 256 * 2**20
MOMENTS = ("exp_avg", "exp_avg_sq", "step")  # of Adam
COUNTS = ("updates", "steps", "scaled_steps")
NUMBERS = ("cpu_s", "scale")
PAST = "past/"  # what begins so is the environments'
DIGEST = "digest"  # of all other arrays


def write_checkpoint(path: Path, learner: Learner) -> None:
    """Write the file at once."""
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays_of(learner).items()}
    with replacing(path) as draft:
        draft.write_bytes(to_bytes({**arrays, DIGEST: _digest(arrays)}))


def read_arrays(path: Path) -> dict[str, Array]:
    """The arrays of a file.

    Raises:
        CommandError: it is damaged.
    """
    try:
        arrays: dict[str, Array] = from_bytes(read_bytes(path, MOST_BYTES))
        if not np.array_equal(arrays.pop(DIGEST, np.empty(0)), _digest(arrays)):
            raise ValueError("its digest does not fit")
    except (ValueError, OSError, SafetensorError) as error:
        raise damaged(path, error) from error
    return arrays


def _digest(arrays: Mapping[str, Array]) -> Array:
    """Of names, types, shapes and content, (32,) uint8."""
    found = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        found.update(f"{name} {array.dtype} {array.shape}".encode())
        found.update(array.tobytes())
    return np.frombuffer(found.digest(), np.uint8)


def damaged(path: Path, error: object) -> CommandError:
    """What to raise about a checkpoint."""
    return CommandError(f"{path} is damaged ({error}): delete the folder and train again")


def arrays_of(learner: Learner) -> dict[str, Array]:
    """Weights, Adam's moments, the generator, counters, the scale of rewards and the scaling of the inputs."""
    wiring = learner.envs.wired.wiring
    found: dict[str, Array] = {
        "generator": learner.generator.get_state().numpy(),
        "counts": np.array([getattr(learner, name) for name in COUNTS], np.int64),
        "numbers": np.array([getattr(learner, name) for name in NUMBERS]),
        "return": np.array([] if np.isnan(learner.returns.mean) else [learner.returns.mean]),
        "mean": np.array(wiring.mean),
        "deviation": np.array(wiring.deviation),
    }
    for name, weight in learner.network.named_parameters():
        found[f"network/{name}"] = weight.detach().numpy().copy()
        for moment, value in learner.optimizer.state[weight].items():
            found[f"adam/{name}/{moment}"] = value.numpy().copy()
    if learner.between_starts:
        found |= {PAST + name: array for name, array in learner.envs.past().items()}
        found |= {name: array.copy() for name, array in _running(learner).items()}
    return found


def _running(learner: Learner) -> dict[str, Array]:
    """What a learner itself knows of the running episodes; the arrays themselves."""
    counted = learner.returns
    return {
        "discounted": learner.discounted,
        "returns/found": counted.found,
        "returns/begun": counted.begun,
        "returns/known": counted.known,
    }


def restore(learner: Learner, arrays: Mapping[str, Array]) -> None:
    """Put a learner where another one of the same settings was.

    Raises:
        ValueError: arrays are missing, have other shapes or types, or hold what is not finite.
    """
    try:
        _restore(learner, arrays)
    except (KeyError, RuntimeError, TypeError) as error:
        raise ValueError(f"it does not fit: {error}") from error


def _restore(learner: Learner, arrays: Mapping[str, Array]) -> None:
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise ValueError(f"the array {name} has entries that are not finite")
    counts, numbers = arrays["counts"], arrays["numbers"]
    if counts.shape != (len(COUNTS),) or counts.dtype != np.int64 or (counts < 0).any() or numbers.shape != (2,):
        raise ValueError("its counters make no sense")
    for name, weight in learner.network.named_parameters():
        _copy(weight, arrays[f"network/{name}"])
        found = [moment for moment in MOMENTS if f"adam/{name}/{moment}" in arrays]
        if found:
            learner.optimizer.state[weight] = {
                moment: torch.from_numpy(arrays[f"adam/{name}/{moment}"].copy()) for moment in found
            }
            if len(found) != len(MOMENTS) or learner.optimizer.state[weight]["exp_avg"].shape != weight.shape:
                raise ValueError(f"Adam's moments of {name} do not fit")
    for name, count in zip(COUNTS, counts.tolist(), strict=True):
        setattr(learner, name, count)
    learner.cpu_s, learner.scale = numbers.tolist()
    learner.generator.set_state(torch.from_numpy(arrays["generator"].copy()))
    learner.returns.mean = float(arrays["return"][0]) if arrays["return"].size else np.nan
    if learner.between_starts:
        _go_on(learner, arrays)


def _go_on(learner: Learner, arrays: Mapping[str, Array]) -> None:
    """Put the running episodes where they were."""
    past = {name.removeprefix(PAST): array for name, array in arrays.items() if name.startswith(PAST)}
    learner.discounted = np.zeros(learner.envs.num_envs)
    for name, place in _running(learner).items():
        _check(arrays[name], place)
        place[...] = arrays[name]
    learner.rows = learner.envs.resume(past)


def _check(array: Array, place: Array) -> None:
    """Whether an array has the shape and the type of its place."""
    if array.shape != place.shape or array.dtype != place.dtype:
        raise ValueError(f"an array has shape {array.shape} and type {array.dtype}, not {place.shape} {place.dtype}")


def _copy(weight: torch.nn.Parameter, array: Array) -> None:
    _check(array, weight.detach().numpy())
    with torch.no_grad():
        weight.copy_(torch.from_numpy(array))
