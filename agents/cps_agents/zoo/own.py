"""Keep a network that another library has trained, so that every command plays it as `zoo:FOLDER`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.machine import versions
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save
from cps_agents.zoo.network import ACTIVATIONS, Layer, unscaled
from cps_agents.zoo.references import reference_to
from cps_agents.zoo.wired import Head, card_entry, count_actions, with_scaling
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.learning.wiring import WiredBox
from cps_envs.core.types import Array, Role

RAW = "weights.npz"  # beside a card that could not be written


def save_network(
    folder: str | Path,
    envs: Any,
    layers: Any,
    *,
    agent: str | None = None,
    activation: str | None = None,
    log_deviation: Array | None = None,
    sampled: bool = False,
    facts: Mapping[str, Any] | None = None,
) -> str:
    """Write a network that was trained in `envs` into a folder; returns the name that plays it, `zoo:FOLDER`.

    `envs` is any environment of this package with the interface for learners: of `gymnasium.make`, `make_vec`,
    `learning_env`, or of PettingZoo, where `agent` names one whose role the network plays. The network takes its rows.
    Its outputs are logits of the discrete actions, one entry after the other, or the means of continuous ones, whose
    `log_deviation` (k,) is needed to draw them.

    `layers` are dense ones, in one of these forms:

    - a PyTorch `nn.Sequential` of `nn.Linear` with `nn.Tanh` or `nn.ReLU` between them, also nested;
    - a list of `nn.Linear`, or of pairs (weight (outputs, inputs), bias (outputs,)) of arrays or tensors;
    - parameters of Flax, `{"params": {"Dense_0": {"kernel": (inputs, outputs), "bias": (outputs,)}, ...}}`.

    `activation` lies between the layers, "tanh" or "relu"; None: what the `nn.Sequential` has, or tanh. With `sampled`
    actions are drawn. `facts` are notes for the card, such as steps and CPU seconds.

    Raises:
        ConfigurationError: the layers do not fit the environments or one another. Their arrays are kept all the same,
            in `FOLDER/weights.npz`.
        OSError: the files cannot be written.
    """
    found: list[Layer] = []
    try:
        env, space, actions = _seat(envs, agent)
        found += _layers(layers)
        chosen = activation or _activation(layers) or ACTIVATIONS[0]
        network = unscaled(space.shape[0], found, chosen, log_deviation)
        _check(found, space, actions, chosen)
        path = Path(folder) / "policy.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        facts_of_run = {"0": dict(facts or {})}
        unknown = {"algorithm": "own", "recipe": {}, "best": 0, "seeds": facts_of_run, "command": ""}
        role = env.role if agent is None else env.roles[agent]
        head = Head(None, sampled)
        card = card_of_network(env, role, space, actions, head, chosen, name=Path(folder).name, **unknown)
        save(path, card, {0: with_scaling(network, space.wiring)})
    except (ConfigurationError, ValueError, TypeError) as error:
        kept = _keep(Path(folder), found or layers)
        raise ConfigurationError(f"{error}. {kept}") from error
    return reference_to(Path(folder))


def card_of_network(
    env: Any, role: Role, space: WiredBox, actions: Any, head: Head, activation: str = "tanh", **known: Any
) -> Card:
    """The card of a network that was trained in `env` on rows of `space`; `known` is what these do not tell."""
    met = env.opponent if isinstance(env.opponent, str) else type(env.opponent).__name__
    return Card(
        problem=known.pop("problem", env.problem.name),
        opponent=known.pop("opponent", met),
        version=env.problem.version,
        role=role,
        preset=env.preset,
        overrides=env.overrides,
        activation=activation,
        head="discrete" if choices_of(actions) else "gaussian",
        decentralised=space.local,
        observation_size=space.shape[0],
        actions=count_actions(actions),
        versions=versions(),
        wiring=card_entry(space.wiring, head),
        **known,
    )


def _seat(envs: Any, agent: str | None) -> tuple[Any, WiredBox, Any]:
    """The environment, and the spaces of a row and of its actions.

    Raises:
        ConfigurationError: it has several agents and none is named, or the game's own observations.
    """
    env = getattr(envs, "unwrapped", envs)
    if hasattr(env, "possible_agents"):
        if agent not in env.possible_agents:
            raise ConfigurationError(f"agent = {agent!r} must be one of {', '.join(env.possible_agents[:9])}")
        space, actions = env.observation_space(agent), env.action_space(agent)
    else:
        space = getattr(env, "single_observation_space", getattr(env, "observation_space", None))
        actions = getattr(env, "single_action_space", getattr(env, "action_space", None))
    if not isinstance(space, WiredBox):
        raise ConfigurationError(
            "a network is kept with how its inputs are made, and this environment has the game's own observations: "
            'make it with interface="learning"'
        )
    return env, space, actions


def _layers(layers: Any) -> Iterator[Layer]:
    """Pairs of weight (outputs, inputs) and bias from any of the forms.

    Raises:
        TypeError: it is none of them.
    """
    if isinstance(layers, Mapping):
        inner = layers.get("params", layers)
        dense = [inner[name] for name in sorted(inner, key=_number)] if isinstance(inner, Mapping) else []
        if not dense or not all(isinstance(each, Mapping) and {"kernel", "bias"} <= set(each) for each in dense):
            raise TypeError("a dictionary of layers has to be Flax's: a kernel and a bias for each Dense layer")
        yield from ((np.asarray(each["kernel"]).T, np.asarray(each["bias"])) for each in dense)
        return
    for each in _linear(layers):
        if hasattr(each, "weight") and hasattr(each, "bias"):
            yield _array(each.weight), _array(each.bias)
        elif isinstance(each, Sequence) and len(each) == 2:
            yield _array(each[0]), _array(each[1])
        else:
            raise TypeError(f"{shown(each)} is no dense layer: write nn.Linear, or a pair of weight and bias")


def _linear(layers: Any) -> Iterator[Any]:
    """The layers one after the other, without the activations between them."""
    children = getattr(layers, "children", None)
    if hasattr(layers, "weight"):
        yield layers
        return
    for each in children() if callable(children) else layers:
        nested = callable(getattr(each, "children", None)) and not hasattr(each, "weight")
        if nested and any(True for _ in each.children()):
            yield from _linear(each)
        elif type(each).__name__ not in MODULES:
            yield each


MODULES = {"Tanh": "tanh", "ReLU": "relu", "Flatten": "", "Identity": ""}  # without weights


def _activation(layers: Any) -> str:
    """The activation of a module, "" if it names none.

    Raises:
        ConfigurationError: there are several.
    """
    modules = getattr(layers, "modules", None)
    names = {MODULES.get(type(each).__name__, "") for each in modules()} - {""} if callable(modules) else set()
    if len(names) > 1:
        raise ConfigurationError(f"the layers have {' and '.join(sorted(names))} between them, and one is allowed")
    return next(iter(names), "")


def _check(layers: Sequence[Layer], space: WiredBox, actions: Any, activation: str) -> None:
    """Check that the layers fit one another and the environment.

    Raises:
        ConfigurationError: they do not.
    """
    if activation not in ACTIVATIONS:
        raise ConfigurationError(f"activation = {activation!r} must be one of {', '.join(ACTIVATIONS)}")
    outputs = sum(count_actions(actions))
    sizes = [space.shape[0], *(len(bias) for _, bias in layers)]
    shapes = [np.shape(weight)[::-1] for weight, _ in layers]
    if shapes != list(pairwise(sizes)) or sizes[-1] != outputs:
        listed = ", ".join(str(np.shape(weight)) for weight, _ in layers)
        raise ConfigurationError(
            f"the layers have the shapes {listed} (outputs, inputs), but a row has {space.shape[0]} inputs and the "
            f"actions need {outputs} outputs"
        )


def _keep(folder: Path, layers: Any) -> str:
    """Write the arrays of layers as they are; says where."""
    try:
        arrays = [np.asarray(part) for layer in layers for part in layer]
        folder.mkdir(parents=True, exist_ok=True)
        np.savez(folder / RAW, *arrays)
    except (TypeError, ValueError, OSError, AttributeError) as error:
        return f"Its weights could not be kept either ({error})"
    return f"The weights are kept in {folder / RAW}"


def _array(values: Any) -> Array:
    """An array of an array or a tensor, which may need gradients."""
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)


def _number(name: str) -> tuple[int, str]:
    digits = "".join(character for character in name if character.isdigit())
    return int(digits or 0), name
