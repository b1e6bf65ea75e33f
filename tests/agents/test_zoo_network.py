"""The forward pass without PyTorch against PyTorch's own, and against itself in batches of other sizes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_agents.zoo.network import MOST_LOG_DEVIATION, PART, Network, check_fit, network_of

torch = pytest.importorskip("torch")


def make_network(seed: int, activation: str = "tanh", inputs: int = 5, outputs: int = 3) -> Network:
    generator = np.random.default_rng(seed)

    def dense(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
        weight = generator.normal(size=(rows, columns)) / np.sqrt(rows)
        return weight.astype(np.float32), generator.normal(size=columns).astype(np.float32)

    return Network(
        columns=generator.permutation(inputs + 2)[:inputs],
        mean=generator.normal(size=inputs).astype(np.float32),
        deviation=generator.uniform(0.1, 2, inputs).astype(np.float32),
        layers=(dense(inputs, 16), dense(16, 8), dense(8, outputs)),
        activation=activation,
        log_deviation=generator.normal(size=outputs).astype(np.float32),
    )


def by_torch(network: Network, rows: np.ndarray) -> np.ndarray:
    values = torch.as_tensor((rows[:, network.columns] - network.mean) / network.deviation).clamp(-5.0, 5.0)
    activate = torch.tanh if network.activation == "tanh" else torch.relu
    for place, (weight, bias) in enumerate(network.layers):
        values = values @ torch.as_tensor(weight) + torch.as_tensor(bias)
        values = activate(values) if place < len(network.layers) - 1 else values
    return values.numpy()


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_equals_torch(activation: str) -> None:
    network = make_network(0, activation)
    rows = np.random.default_rng(1).uniform(-1, 1, (9, 7)).astype(np.float32)
    np.testing.assert_allclose(network.forward(rows), by_torch(network, rows), atol=1e-5)


@given(seed=st.integers(0, 100), envs=st.integers(1, 9))
def test_an_environment_does_not_depend_on_the_others(seed: int, envs: int) -> None:
    network = make_network(seed)
    rows = np.random.default_rng(seed).uniform(-1, 1, (envs, 7)).astype(np.float32)
    together = network.forward(rows)
    for b in range(envs):
        np.testing.assert_array_equal(network.forward(rows[b : b + 1]), together[b : b + 1])


def test_a_large_batch_is_its_parts() -> None:
    network = make_network(0, inputs=21)
    rows = np.random.default_rng(2).uniform(-1, 1, (2 * PART + 3, 23)).astype(np.float32)
    together = network.forward(rows)
    for b in (0, PART - 1, PART, 2 * PART + 2):
        np.testing.assert_array_equal(network.forward(rows[b : b + 1]), together[b : b + 1])


def test_survives_a_round_trip() -> None:
    network = make_network(3, "relu")
    again = network_of(network.tensors(), "relu")
    assert again.activation == network.activation
    for name, array in network.tensors().items():
        np.testing.assert_array_equal(array, again.tensors()[name])


def test_refuses_arrays_that_do_not_fit() -> None:
    tensors = make_network(0).tensors()
    with pytest.raises(ValueError, match="activation"):
        network_of(tensors, "swish")
    with pytest.raises(ValueError, match=r"layer\.1\.bias.* is missing"):
        network_of({name: array for name, array in tensors.items() if name != "layer.1.bias"}, "tanh")
    with pytest.raises(ValueError, match="a layer over 16 values"):
        network_of({**tensors, "layer.1.weight": np.zeros((3, 8), np.float32)}, "tanh")
    with pytest.raises(ValueError, match="not finite"):
        network_of({**tensors, "mean": np.full(5, np.nan, np.float32)}, "tanh")
    with pytest.raises(ValueError, match="input scaling"):
        network_of({**tensors, "mean": np.zeros(4, np.float32)}, "tanh")
    with pytest.raises(ValueError, match="no layer"):
        network_of({"columns": tensors["columns"], "mean": tensors["mean"], "deviation": tensors["deviation"]}, "tanh")


def test_a_network_has_to_fit_what_it_sees_and_what_it_says() -> None:
    network = make_network(0)
    read = int(network.columns.max())
    check_fit(network, read + 1, 3)
    with pytest.raises(ValueError, match=f"to {read} of an observation of {read} values"):
        check_fit(network, read, 3)
    with pytest.raises(ValueError, match="3 outputs where 4 are needed"):
        check_fit(network, read + 1, 4)


def test_a_deviation_may_be_as_large_as_the_limit() -> None:
    tensors = make_network(0).tensors() | {"log_deviation": np.full(3, MOST_LOG_DEVIATION, np.float32)}
    assert network_of(tensors, "tanh").log_deviation is not None
    tensors["log_deviation"][0] = np.nextafter(np.float32(MOST_LOG_DEVIATION), np.float32(np.inf))
    with pytest.raises(ValueError, match="logarithms"):
        network_of(tensors, "tanh")
