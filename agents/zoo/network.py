"""A policy network without a deep-learning library: scaled inputs, an optional LSTM, dense layers.

The forward pass goes environment by environment, in the order of the columns. So an environment's output does not
depend on how many others are in the batch, not even by rounding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.core.types import Array, IntArray

Tensor: TypeAlias = NDArray[np.float32]
Dense: TypeAlias = tuple[Tensor, Tensor]  # weight (inputs, outputs), bias (outputs,)
ACTIVATIONS = ("tanh", "relu")
CLIP = 5.0  # bound of a scaled input


@dataclass(frozen=True)
class Memory:
    """A long short-term memory; the gates are input, forget, cell, output, as in PyTorch."""

    inward: Dense  # (inputs, 4 units)
    recurrent: Dense  # (units, 4 units)

    @property
    def units(self) -> int:
        """Number of hidden units."""
        return len(self.recurrent[0])


@dataclass(frozen=True)
class Network:
    """`columns` of the observation, scaled to (value - mean) / deviation and clipped, through memory and layers."""

    columns: IntArray  # (inputs,)
    mean: Tensor  # (inputs,)
    deviation: Tensor  # (inputs,)
    layers: tuple[Dense, ...]  # the last one is linear
    activation: str  # between the layers
    memory: Memory | None = None
    log_deviation: Tensor | None = None  # of Gaussian actions (outputs,)

    @property
    def num_outputs(self) -> int:
        """Size of what `forward` returns."""
        return len(self.layers[-1][1])

    @property
    def units(self) -> int:
        """Hidden units of the memory, 0 without one."""
        return 0 if self.memory is None else self.memory.units

    def forward(self, observation: Array, hidden: Tensor, cell: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Outputs (B, num_outputs) for observations (B, n), and the memory's state, two arrays (B, units)."""
        scaled = np.clip((observation[:, self.columns] - self.mean) / self.deviation, -CLIP, CLIP)
        values = scaled.astype(np.float32, order="C")  # chosen columns may lie in another order, for another kernel
        if self.memory is not None:
            gates = _dense(values, *self.memory.inward) + _dense(hidden, *self.memory.recurrent)
            hidden, cell = _remember(gates, cell)
            values = hidden
        for place, layer in enumerate(self.layers):
            values = _dense(values, *layer)
            if place < len(self.layers) - 1:
                values = np.tanh(values) if self.activation == "tanh" else np.maximum(values, np.float32(0))
        return values, hidden, cell

    def tensors(self) -> dict[str, Array]:
        """The arrays by name, for a file."""
        named: dict[str, Array] = {"columns": self.columns, "mean": self.mean, "deviation": self.deviation}
        for place, (weight, bias) in enumerate(self.layers):
            named |= {f"layer.{place}.weight": weight, f"layer.{place}.bias": bias}
        if self.memory is not None:
            for name, (weight, bias) in (("inward", self.memory.inward), ("recurrent", self.memory.recurrent)):
                named |= {f"memory.{name}.weight": weight, f"memory.{name}.bias": bias}
        if self.log_deviation is not None:
            named["log_deviation"] = self.log_deviation
        return {name: np.ascontiguousarray(array) for name, array in named.items()}


def network_of(tensors: Mapping[str, Array], activation: str) -> Network:
    """The network of arrays as `Network.tensors` names them.

    Raises:
        ValueError: arrays are missing, do not fit together or are not finite, or the activation is unknown.
    """
    if activation not in ACTIVATIONS:
        raise ValueError(f"activation {activation!r} is none of {', '.join(ACTIVATIONS)}")
    try:
        count = sum(name.startswith("layer.") and name.endswith(".weight") for name in tensors)
        layers = tuple((tensors[f"layer.{place}.weight"], tensors[f"layer.{place}.bias"]) for place in range(count))
        memory = None
        if "memory.inward.weight" in tensors:
            inward, recurrent = (
                (tensors[f"memory.{name}.weight"], tensors[f"memory.{name}.bias"]) for name in ("inward", "recurrent")
            )
            memory = Memory(inward, recurrent)
        network = Network(
            columns=tensors["columns"],
            mean=tensors["mean"],
            deviation=tensors["deviation"],
            layers=layers,
            activation=activation,
            memory=memory,
            log_deviation=tensors.get("log_deviation"),
        )
    except KeyError as error:
        raise ValueError(f"the array {error} is missing") from error
    _check(network)
    return network


def _check(network: Network) -> None:
    if not network.layers:
        raise ValueError("there is no layer")
    width = len(network.columns)
    if not network.mean.shape == network.deviation.shape == (width,):
        raise ValueError("the input scaling does not fit the columns")
    dense = list(network.layers)
    if network.memory is not None:
        units = network.memory.units
        shapes = (network.memory.inward[0].shape, network.memory.recurrent[0].shape)
        if shapes != ((width, 4 * units), (units, 4 * units)):
            raise ValueError(f"a memory of {units} units over {width} inputs has arrays of shapes {shapes}")
        width = units
    for weight, bias in dense:
        if weight.ndim != 2 or weight.shape[0] != width or bias.shape != (weight.shape[1],):
            raise ValueError(f"a layer over {width} values has a weight {weight.shape} and a bias {bias.shape}")
        width = weight.shape[1]
    if not all(np.isfinite(array).all() for array in network.tensors().values()):
        raise ValueError("an array has entries that are not finite")


def _dense(values: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """`values` (B, n) times `weight` (n, m) plus `bias`."""
    result = np.empty((len(values), len(bias)), np.float32)
    _multiply(values, weight, bias, result)
    return result


@kernel
def _multiply(values: Tensor, weight: Tensor, bias: Tensor, result: Tensor) -> None:
    for b in range(values.shape[0]):
        row = result[b]
        row[:] = bias
        for entry in range(values.shape[1]):
            factor = values[b, entry]
            for output in range(row.shape[0]):
                row[output] += factor * weight[entry, output]


def _remember(gates: Tensor, cell: Tensor) -> tuple[Tensor, Tensor]:
    """Hidden and cell state (B, units) after gates (B, 4 units)."""
    enter, keep, candidate, leave = np.split(gates, 4, axis=1)
    cell = _sigmoid(keep) * cell + _sigmoid(enter) * np.tanh(candidate)
    return (_sigmoid(leave) * np.tanh(cell)).astype(np.float32), cell.astype(np.float32)


def _sigmoid(values: Tensor) -> Tensor:
    result: Tensor = np.float32(0.5) * (np.tanh(np.float32(0.5) * values) + np.float32(1.0))
    return result
