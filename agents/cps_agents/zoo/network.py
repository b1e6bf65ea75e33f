"""A policy network without a deep-learning library: scaled inputs, dense layers, and before them perhaps an LSTM.

Each environment's sums go in the order of the inputs, one after the other, without fused operations. So its output does
not depend on how many others are in the batch, not even by rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.types import Array, IntArray

Tensor: TypeAlias = NDArray[np.float32]
Dense: TypeAlias = tuple[Tensor, Tensor]  # weight (inputs, outputs), bias (outputs,)
Cell: TypeAlias = tuple[
    Tensor, Tensor, Tensor
]  # of an LSTM: weights (inputs, 4 H) and (H, 4 H), bias (4 H,); gates i f g o
Remembered: TypeAlias = tuple[Tensor, Tensor]  # hidden values and cells, (B, cells, H)
Layer: TypeAlias = tuple[Array, Array]  # weight (outputs, inputs) and bias (outputs,), as PyTorch has them
ACTIVATIONS = ("tanh", "relu")
CELL = ("weight", "again", "bias")  # the arrays of an LSTM cell
CLIP = 5.0  # bound of a scaled input
PART = 512  # environments whose values stay in the second-level cache from layer to layer
MOST = 1e6  # size of an entry of a file; no network that was trained comes near
MOST_LOG_DEVIATION = 20.0
ROWS = 16  # environments that use a few rows of weights in turn, while these lie in the first-level cache


@dataclass(frozen=True)
class Network:
    """`columns` of the inputs, scaled to (value - mean) / deviation and clipped, through the layers.

    With `normal` they are then scaled a second time, by statistics that a learner kept beside the network. With `cells`
    they go through LSTM cells first, and `recall` plays it.
    """

    columns: IntArray  # (inputs,)
    mean: Tensor  # (inputs,)
    deviation: Tensor  # (inputs,)
    layers: tuple[Dense, ...]  # the last one is linear
    activation: str  # between the layers
    log_deviation: Tensor | None = None  # of Gaussian actions (outputs,)
    normal: Tensor | None = None  # (3, inputs): mean, deviation, and the bound of the result
    cells: tuple[Cell, ...] = ()

    @property
    def num_outputs(self) -> int:
        """Size of what `forward` returns."""
        return len(self.layers[-1][1])

    def forward(self, rows: Array) -> Tensor:
        """Outputs (B, num_outputs) for rows of inputs (B, n).

        Raises:
            ValueError: the network has cells.
        """
        if self.cells:
            raise ValueError("this network has a memory: it plays only where episodes go on from step to step")
        if len(rows) > PART:
            return np.concatenate([self.forward(rows[start : start + PART]) for start in range(0, len(rows), PART)])
        return self._through(self._scaled(rows))

    def recall(self, rows: Array, state: Remembered) -> tuple[Tensor, Remembered]:
        """Outputs (B, num_outputs) for rows (B, n) of episodes that remember `state`, and what they remember then."""
        values, hidden, kept = self._scaled(rows), [], []
        for place, (weight, again, bias) in enumerate(self.cells):
            gates = _dense(values, weight, bias) + _dense(np.ascontiguousarray(state[0][:, place]), again, 0 * bias)
            enter, forget, new, show = np.split(gates, 4, axis=1)
            cell = _sigmoid(forget) * state[1][:, place] + _sigmoid(enter) * np.tanh(new)
            values = np.ascontiguousarray(_sigmoid(show) * np.tanh(cell))
            hidden.append(values)
            kept.append(cell)
        return self._through(values), (np.stack(hidden, axis=1), np.stack(kept, axis=1))

    def blank(self, count: int) -> Remembered:
        """What so many episodes remember at their start."""
        shape = (count, len(self.cells), len(self.cells[0][1]))
        return np.zeros(shape, np.float32), np.zeros(shape, np.float32)

    def _scaled(self, rows: Array) -> Tensor:
        values = np.empty((len(rows), len(self.columns)), np.float32)
        _scale(np.ascontiguousarray(rows), self.columns, self.mean, self.deviation, values)
        if self.normal is not None:
            mean, deviation, bound = self.normal
            values = np.clip((values - mean) / deviation, -bound, bound)
        return values

    def _through(self, values: Tensor) -> Tensor:
        for place, layer in enumerate(self.layers):
            values = _dense(values, *layer)
            if place < len(self.layers) - 1:
                if self.activation == "tanh":
                    np.tanh(values, out=values)
                else:
                    np.maximum(values, np.float32(0), out=values)
        return values

    def tensors(self) -> dict[str, Array]:
        """The arrays by name, for a file."""
        named: dict[str, Array] = {"columns": self.columns, "mean": self.mean, "deviation": self.deviation}
        for place, (weight, bias) in enumerate(self.layers):
            named |= {f"layer.{place}.weight": weight, f"layer.{place}.bias": bias}
        for place, cell in enumerate(self.cells):
            named |= {f"cell.{place}.{part}": array for part, array in zip(CELL, cell, strict=True)}
        named |= {} if self.log_deviation is None else {"log_deviation": self.log_deviation}
        named |= {} if self.normal is None else {"normal": self.normal}
        return {name: np.ascontiguousarray(array) for name, array in named.items()}


def unscaled(inputs: int, layers: Sequence[Layer], activation: str, log_deviation: Array | None) -> Network:
    """The network of layers from a library of deep learning, which takes its inputs as they are."""
    return Network(
        columns=np.arange(inputs),
        mean=np.zeros(inputs, np.float32),
        deviation=np.ones(inputs, np.float32),
        layers=tuple((np.ascontiguousarray(_copy(weight).T), _copy(bias)) for weight, bias in layers),
        activation=activation,
        log_deviation=None if log_deviation is None else _copy(log_deviation),
    )


def _copy(values: Array) -> Tensor:
    return np.asarray(values).astype(np.float32)


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
        remembering = sum(name.startswith("cell.") and name.endswith(".weight") for name in tensors)
        cells = ((tensors[f"cell.{place}.{part}"] for part in CELL) for place in range(remembering))
        network = Network(
            columns=tensors["columns"],
            mean=tensors["mean"],
            deviation=tensors["deviation"],
            layers=layers,
            activation=activation,
            log_deviation=tensors.get("log_deviation"),
            normal=tensors.get("normal"),
            cells=tuple((weight, again, bias) for weight, again, bias in cells),
        )
    except KeyError as error:
        raise ValueError(f"the array {error} is missing") from error
    _check(network)
    return network


def check_fit(network: Network, observation_size: int, outputs: int) -> None:
    """Check that a network reads this many observed values and has this many outputs.

    Raises:
        ValueError: it does not.
    """
    low, high = int(network.columns.min()), int(network.columns.max())
    if low < 0 or high >= observation_size:
        raise ValueError(f"it reads the columns {low} to {high} of an observation of {observation_size} values")
    if network.num_outputs != outputs:
        raise ValueError(f"it has {network.num_outputs} outputs where {outputs} are needed")


def _check(network: Network) -> None:
    if not network.layers:
        raise ValueError("there is no layer")
    for name, array in network.tensors().items():
        _check_array(name, array)
    width = len(network.columns)
    if not network.mean.shape == network.deviation.shape == (width,):
        raise ValueError("the input scaling does not fit the columns")
    if (network.deviation <= 0).any():
        raise ValueError("a deviation is not above 0")
    if network.normal is not None and (network.normal.shape != (3, width) or (network.normal[1:] <= 0).any()):
        raise ValueError("the second scaling of the inputs does not fit the columns")
    if len({again.shape for _, again, _ in network.cells}) > 1:
        raise ValueError("the LSTM cells have different sizes")
    for weight, again, bias in network.cells:
        units = len(again)
        if (weight.shape, again.shape, bias.shape) != ((width, 4 * units), (units, 4 * units), (4 * units,)):
            raise ValueError(f"an LSTM cell over {width} values has weights {weight.shape} and {again.shape}")
        width = units
    for weight, bias in network.layers:
        if weight.ndim != 2 or weight.shape[0] != width or weight.shape[1] == 0 or bias.shape != (weight.shape[1],):
            raise ValueError(f"a layer over {width} values has a weight {weight.shape} and a bias {bias.shape}")
        width = weight.shape[1]
    spread = network.log_deviation
    if spread is not None and (spread.shape != (width,) or np.abs(spread).max() > MOST_LOG_DEVIATION):
        raise ValueError(f"the logarithms of the deviations are no {width} values within {MOST_LOG_DEVIATION:g}")


def _check_array(name: str, array: Array) -> None:
    """Type, rank, and that all entries are finite and of a size with which nothing overflows."""
    wanted = np.int64 if name == "columns" else np.float32
    if array.dtype != wanted:
        raise ValueError(f"the array {name} has type {array.dtype}, not {np.dtype(wanted)}")
    if array.ndim == 0 or array.size == 0:
        raise ValueError(f"the array {name} is empty")
    if not np.isfinite(array).all():
        raise ValueError(f"the array {name} has entries that are not finite")
    if name != "columns" and np.abs(array).max() > MOST:
        raise ValueError(f"the array {name} has entries beyond {MOST:g}")


def _dense(values: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """`values` (B, n) times `weight` (n, m) plus `bias`."""
    result = np.empty((len(values), len(bias)), np.float32)
    _multiply(values, weight, bias, result)
    return result


def _sigmoid(values: Tensor) -> Tensor:
    found: Tensor = np.float32(0.5) * (np.tanh(np.float32(0.5) * values) + np.float32(1))
    return found


@kernel
def _scale(observation: Array, columns: IntArray, mean: Tensor, deviation: Tensor, values: Tensor) -> None:
    for b in range(values.shape[0]):
        for entry in range(values.shape[1]):
            value = (observation[b, columns[entry]] - mean[entry]) / deviation[entry]
            values[b, entry] = -CLIP if value < -CLIP else CLIP if value > CLIP else value  # NaN stays visible


@kernel
def _multiply(values: Tensor, weight: Tensor, bias: Tensor, result: Tensor) -> None:
    """Sum eight inputs at a time: the result is loaded and stored once for eight products."""
    inputs, outputs = weight.shape
    whole = inputs - inputs % 8
    for first in range(0, values.shape[0], ROWS):
        last = min(first + ROWS, values.shape[0])
        for b in range(first, last):
            result[b] = bias
        for i in range(0, whole, 8):
            w0, w1, w2, w3 = weight[i], weight[i + 1], weight[i + 2], weight[i + 3]
            w4, w5, w6, w7 = weight[i + 4], weight[i + 5], weight[i + 6], weight[i + 7]
            for b in range(first, last):
                row, x = result[b], values[b, i : i + 8]
                x0, x1, x2, x3, x4, x5, x6, x7 = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]
                for k in range(outputs):
                    total = row[k] + x0 * w0[k] + x1 * w1[k] + x2 * w2[k] + x3 * w3[k]
                    row[k] = total + x4 * w4[k] + x5 * w5[k] + x6 * w6[k] + x7 * w7[k]
        for i in range(whole, inputs):
            for b in range(first, last):
                row, factor = result[b], values[b, i]
                for k in range(outputs):
                    row[k] += factor * weight[i, k]
