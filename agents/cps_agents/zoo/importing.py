"""Models of stable-baselines3 as weights and a card, which play without it and run no code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.torch_layers import FlattenExtractor
from torch import nn

from cps_agents.errors import CommandError
from cps_agents.machine import versions
from cps_agents.sb3_models import explores_by_state, head_of, policy_of
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save
from cps_agents.zoo.lookup import USUAL, read_model, statistics_of
from cps_agents.zoo.network import Layer, Network, unscaled
from cps_agents.zoo.references import SB3, models_in
from cps_agents.zoo.wired import Recalling, card_entry, count_actions, with_scaling
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.learning.wiring import Wiring
from cps_envs.core.policies.lookup import parsed
from cps_envs.core.policies.policy import takes_masks
from cps_envs.core.policies.reference import Reference
from cps_envs.core.types import Array, Observation
from cps_envs.registration import PROBLEMS, find_role

ACTIVATIONS = {nn.Tanh: "tanh", nn.ReLU: "relu"}
OPTIONS = ("algorithm", "vecnormalize", "sampled")
SAMPLE = 256  # rows on which the network has to act as the model does
ALIKE = 0.99  # of them, where two actions are as likely as one another
PRESET = "learning"
SHARED = ("problem", "role", "algorithm", "activation", "head", "observation_size", "actions", "wiring")  # by seeds


def import_models(reference: str, target: Path, role: str | None = None) -> Card:
    """Write the model of `sb3:FILE.zip`, or those of `sb3:FOLDER` by training seed, as one card with their weights.

    Options of the reference are `algorithm`, `vecnormalize` and `sampled`, as where it is played. `role`, such as
    FdiAttack, is needed for a model that was trained on a game's own observations.

    Raises:
        CommandError: it is no model of stable-baselines3, or has parts that a card cannot describe.
        UnknownNameError: there is no such file, algorithm or role.
        UntrustedCodeError: the user has not agreed to run what the file holds.
        ValueError: a file is damaged.
    """
    tree = parsed(reference)
    if tree.source != SB3:
        raise CommandError(f"{reference!r} is no model: write sb3:model.zip, or sb3:FOLDER with seed-0/model.zip, ...")
    if odd := sorted(set(tree.options) - set(OPTIONS)):
        raise CommandError(f"{odd[0]} cannot be imported: of options there are {', '.join(OPTIONS)}")
    files = models_in(tree) if Path(tree.name).is_dir() else {0: reference}
    found = {int(seed or 0): _imported(parsed(each), role) for seed, each in files.items()}
    cards = {seed: replace(card, seeds={str(seed): facts}, best=seed) for seed, (card, facts, _) in found.items()}
    first = min(cards)
    for seed, card in cards.items():
        if differing := [name for name in SHARED if getattr(card, name) != getattr(cards[first], name)]:
            raise CommandError(f"the models of seeds {first} and {seed} differ in {differing[0]}: import them apart")
    seeds = {str(seed): found[seed][1] for seed in sorted(found)}
    name, command = target.absolute().parent.name, f"cps-envs zoo import {reference}"
    card = replace(cards[first], name=name, command=command, seeds=seeds, best=first)
    target.parent.mkdir(parents=True, exist_ok=True)
    return save(target, card, {seed: network for seed, (_, _, network) in found.items()})


def _imported(tree: Reference, role: str | None) -> tuple[Card, dict[str, Any], Network]:
    """The card of one model without its seed, what is known of its training, and its network."""
    algorithm, statistics = tree.options.get("algorithm", USUAL), tree.options.get("vecnormalize")
    model = read_model(tree.name, algorithm, statistics)
    space, named = model.observation_space, None if role is None else find_role(role)
    wiring: Wiring | None = getattr(space, "wiring", None)
    problem = named[0] if named else PROBLEMS.get(wiring.problem) if wiring else None
    if problem is None:
        what = f"of {wiring.problem}" if wiring else "trained on a game's own observations"
        raise CommandError(f"{tree.name} is {what}: name its role, as --role FdiAttack")
    if wiring is None:
        assert named is not None
        wiring = Wiring(problem.name, named[1], NATIVE, masked=takes_masks(model), plain=True)
    elif named and (wiring.problem, wiring.role) != (problem.name, named[1]):
        raise CommandError(f"{tree.name} was trained as the {wiring.role} of {wiring.problem}: leave --role out")
    sampled = bool(tree.options.get("sampled", False))
    network, activation = _network(model, tree.name, sampled=sampled)
    if statistics:
        network = replace(network, normal=_statistics(statistics, network))
    head = head_of(model, sampled=sampled)
    _check_alike(model, network, tree.name, statistics)
    network = with_scaling(network, wiring)
    facts = {"steps": int(model.num_timesteps)}
    card = Card(
        name="",
        problem=wiring.problem,
        version=problem.version,
        role=wiring.role,
        algorithm=algorithm,
        opponent="unknown",
        preset=PRESET,
        overrides={},
        recipe={},
        activation=activation,
        head="discrete" if choices_of(model.action_space) else "gaussian",
        decentralised=bool(getattr(space, "local", False)),
        observation_size=int(space.shape[0]),
        actions=count_actions(model.action_space),
        best=0,
        seeds={"0": facts},
        command="",
        versions=versions(),
        wiring=card_entry(wiring, head),
    )
    return card, facts, network


def _network(model: Any, name: str, *, sampled: bool) -> tuple[Network, str]:
    """The network of a model's most likely actions, and the activation between its layers.

    Raises:
        CommandError: it has parts that a card cannot describe.
    """
    policy = policy_of(model)
    if explores_by_state(model) or getattr(policy, "squash_output", False):
        raise CommandError(f"{name} squashes its actions or draws by its state, as gSDE and SAC do: hand it in as code")
    extractor = getattr(policy, "features_extractor", None)
    if extractor is not None and type(extractor) is not FlattenExtractor:
        raise CommandError(f"{name} has the extractor {type(extractor).__name__}: only MlpPolicy and MlpLstmPolicy fit")
    if hasattr(policy, "mlp_extractor") and hasattr(policy, "action_net"):
        modules = [*policy.mlp_extractor.policy_net, policy.action_net]
    elif hasattr(getattr(policy, "q_net", None), "q_net"):
        modules = list(policy.q_net.q_net)
    else:
        raise CommandError(f"{name} is a {type(model).__name__}: only PPO, A2C, RecurrentPPO, MaskablePPO and DQN fit")
    layers = [each for each in modules if isinstance(each, nn.Linear)]
    kinds = {type(each) for each in modules} - {nn.Linear}
    between = [type(each) for each in modules[1::2]]
    if (
        len(kinds) > 1
        or not kinds <= set(ACTIVATIONS)
        or not kinds.issuperset(between)
        or len(layers) * 2 - 1 != len(modules)
    ):
        shown = ", ".join(sorted(each.__name__ for each in kinds))
        raise CommandError(f"{name} has {shown or 'no activation'} between its layers: Tanh or ReLU between all fit")
    activation = ACTIVATIONS[next(iter(kinds))] if kinds else "tanh"
    deviation = getattr(policy, "log_std", None)
    lstm = getattr(policy, "lstm_actor", None)
    if lstm is not None and sampled:
        raise CommandError(f"{name} has a memory, and plays its most likely actions: leave out sampled=true")
    pairs: list[Layer] = [(_array(each.weight), _array(each.bias)) for each in layers]
    inputs = int(model.observation_space.shape[0])
    network = unscaled(inputs, pairs, activation, None if deviation is None else _array(deviation))
    return (network if lstm is None else replace(network, cells=tuple(_cells(lstm)))), activation


def _cells(lstm: Any) -> Sequence[tuple[Array, Array, Array]]:
    """The cells of PyTorch's LSTM, with one bias each."""
    found = []
    for place in range(lstm.num_layers):
        weight, again, one, two = (
            _array(getattr(lstm, f"{part}_l{place}")) for part in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
        )
        found.append((np.ascontiguousarray(weight.T), np.ascontiguousarray(again.T), one + two))
    return found


def _statistics(path: str, network: Network) -> Array | None:
    """The second scaling of the inputs by a file of `VecNormalize`; None if it leaves them as they are.

    Raises:
        CommandError: the statistics are of other inputs.
    """
    kept = statistics_of(path)
    if not kept.norm_obs:
        return None
    mean, variance = (np.asarray(each) for each in (kept.obs_rms.mean, kept.obs_rms.var))
    if mean.shape != network.mean.shape:
        raise CommandError(f"{path} has statistics of {mean.size} inputs, and the model sees {network.mean.size}")
    bound = np.full_like(mean, kept.clip_obs)
    return np.stack([mean, np.sqrt(variance + kept.epsilon), bound]).astype(np.float32)


def _check_alike(model: Any, network: Network, name: str, statistics: str | None) -> None:
    """Let both act in the same rows.

    Raises:
        CommandError: they act differently.
    """
    rows = np.random.default_rng(0).normal(0.0, 1.0, (SAMPLE, model.observation_space.shape[0])).astype(np.float32)
    rows = np.clip(rows, model.observation_space.low, model.observation_space.high)
    seen: Observation = statistics_of(statistics).normalize_obs(rows).astype(np.float32) if statistics else rows
    choices = choices_of(model.action_space)
    if network.cells:
        mine, _ = Recalling(network, choices).predict(rows)
    else:
        found = network.forward(rows)
        parts = np.split(found, np.cumsum(choices)[:-1], axis=1) if choices else []
        taken = np.stack([part.argmax(axis=1) for part in parts], axis=1) if parts else np.clip(found, -1.0, 1.0)
        mine = taken[:, 0] if len(parts) == 1 else taken
    with torch.inference_mode():
        theirs, _ = model.predict(seen, deterministic=True, episode_start=np.ones(SAMPLE, np.bool_))
    close = np.isclose(mine.reshape(SAMPLE, -1), np.asarray(theirs).reshape(SAMPLE, -1), atol=1e-3).all(axis=1)
    if close.mean() < ALIKE:
        raise CommandError(f"{name} acts otherwise than its weights do in {1 - close.mean():.0%} of {SAMPLE} rows")


def _array(tensor: Any) -> Array:
    found: Array = tensor.detach().cpu().numpy().astype(np.float32)
    return found
