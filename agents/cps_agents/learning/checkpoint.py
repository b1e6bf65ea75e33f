"""All that a `Learner` has to remember between two updates, as arrays by name, for a file that runs no code."""

from __future__ import annotations

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


def write_checkpoint(path: Path, learner: Learner) -> None:
    """Write the file at once."""
    with replacing(path) as draft:
        draft.write_bytes(to_bytes({name: np.ascontiguousarray(array) for name, array in arrays_of(learner).items()}))


def read_arrays(path: Path) -> dict[str, Array]:
    """The arrays of a file.

    Raises:
        CommandError: it is damaged.
    """
    try:
        return from_bytes(read_bytes(path, MOST_BYTES))
    except (ValueError, OSError, SafetensorError) as error:
        raise damaged(path, error) from error


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
        "returns": np.array(learner.returns, np.float64),
        "mean": np.array(wiring.mean),
        "deviation": np.array(wiring.deviation),
    }
    for name, weight in learner.network.named_parameters():
        found[f"network/{name}"] = weight.detach().numpy().copy()
        for moment, value in learner.optimizer.state[weight].items():
            found[f"adam/{name}/{moment}"] = value.numpy().copy()
    return found


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
    learner.returns.extend(arrays["returns"].tolist())


def _copy(weight: torch.nn.Parameter, array: Array) -> None:
    if array.shape != weight.shape or array.dtype != np.float32:
        raise ValueError(f"an array has shape {array.shape} and type {array.dtype}, not {tuple(weight.shape)} float32")
    with torch.no_grad():
        weight.copy_(torch.from_numpy(array))
