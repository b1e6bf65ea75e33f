"""Keep a network that another library has trained, so that every command plays it as `zoo:FOLDER`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from cps_agents.machine import versions
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save
from cps_agents.zoo.network import ACTIVATIONS, Layer, unscaled
from cps_agents.zoo.wired import Head, card_entry, count_actions, with_scaling
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.learning.learning_env import LearningVectorEnv
from cps_envs.core.types import Array


def save_network(
    folder: str | Path,
    envs: LearningVectorEnv,
    layers: Sequence[Layer],
    *,
    activation: str = "tanh",
    log_deviation: Array | None = None,
    stickiness: float = 0.0,
    sampled: bool = False,
    facts: Mapping[str, Any] | None = None,
) -> str:
    """Write a network that was trained in `envs` into a folder; returns the name that plays it, `zoo:FOLDER`.

    The network takes rows of `envs`. Its outputs are logits of the discrete actions, one entry after the other, or the
    means of continuous ones, whose `log_deviation` (k,) is needed to draw them. `stickiness` is added to the logit of
    the last action. With `sampled` actions are drawn. `facts` are notes for the card, such as steps and CPU seconds.

    Raises:
        ConfigurationError: the layers do not fit the environments or one another, or there is no such activation.
        OSError: the files cannot be written.
    """
    inputs = envs.wired.columns.size
    network = unscaled(inputs, layers, activation, log_deviation)
    sizes = [inputs, *(len(bias) for _, bias in network.layers)]
    shapes = [weight.shape for weight, _ in network.layers]
    if shapes != list(pairwise(sizes)) or sizes[-1] != envs.wired.columns.last_action:
        raise ConfigurationError(
            f"the layers have the shapes {[shape[::-1] for shape in shapes]} (outputs, inputs), but the rows have "
            f"{inputs} inputs and the actions need {envs.wired.columns.last_action} outputs"
        )
    if activation not in ACTIVATIONS:
        raise ConfigurationError(f"activation = {activation!r} must be one of {', '.join(ACTIVATIONS)}")
    path = Path(folder) / "policy.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    card = card_of_network(
        envs,
        Head(stickiness, None, sampled),
        activation,
        name=Path(folder).name,
        problem=envs.problem.name,
        algorithm="own",
        opponent=envs.opponent if isinstance(envs.opponent, str) else type(envs.opponent).__name__,
        recipe={},
        best=0,
        seeds={"0": dict(facts or {})},
        command="",
    )
    save(path, card, {0: with_scaling(network, envs.wired.wiring)})
    return f"zoo:{folder}"


def card_of_network(envs: LearningVectorEnv, head: Head, activation: str = "tanh", **known: Any) -> Card:
    """The card of a network that was trained in `envs`; `known` is what they do not tell."""
    wired = envs.wired
    return Card(
        version=envs.problem.version,
        role=envs.role,
        preset=envs.preset,
        overrides=envs.overrides,
        activation=activation,
        head="discrete" if wired.choices else "gaussian",
        decentralised=envs.adapter.local,
        observation_size=wired.columns.size,
        actions=count_actions(envs.single_action_space),
        versions=versions(),
        wiring=card_entry(wired.wiring, head),
        **known,
    )
