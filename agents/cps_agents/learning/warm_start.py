"""Going on with a trained network: our own PPO learns from where another run, or a shipped policy, has ended."""

from __future__ import annotations

from dataclasses import dataclass, fields

import torch
from torch import nn

from cps_agents.errors import CommandError
from cps_agents.learning.policy_network import PolicyNetwork
from cps_agents.learning.recipe import SHARED, Recipe, differing, knobs_of
from cps_agents.zoo.files import load
from cps_agents.zoo.network import Network
from cps_agents.zoo.references import card_of
from cps_envs.core.declare.training import Training
from cps_envs.core.learning.wiring import Scaling, Wiring
from cps_envs.core.policies.lookup import parsed

SEEN = {entry.name for entry in fields(Wiring)} & {entry.name for entry in fields(Training)}
SAME = ("problem", "role", *sorted(SEEN), "hidden")  # knobs that both need alike


@dataclass(frozen=True)
class Start:
    """A trained network and how its inputs are scaled."""

    reference: str
    network: Network
    scaling: Scaling

    def put(self, network: PolicyNetwork) -> None:
        """Give the policy these weights; the values begin anew.

        Raises:
            CommandError: the shapes differ.
        """
        layers = [layer for layer in network.policy if isinstance(layer, nn.Linear)]
        found = [(weight.T, bias) for weight, bias in self.network.layers]
        if [each.weight.shape for each in layers] != [weight.shape for weight, _ in found]:
            raise CommandError(f"start = {self.reference!r} has layers of other sizes than the recipe's network")
        with torch.no_grad():
            for layer, (weight, bias) in zip(layers, found, strict=True):
                layer.weight.copy_(torch.from_numpy(weight.copy()))
                layer.bias.copy_(torch.from_numpy(bias.copy()))
            if network.log_deviation is not None and self.network.log_deviation is not None:
                network.log_deviation.copy_(torch.from_numpy(self.network.log_deviation.copy()))


def read_start(recipe: Recipe) -> Start | None:
    """Where a recipe's learning begins; None: with random weights.

    Raises:
        CommandError: that is no network that plays as the recipe's does.
        UnknownNameError: there is no such policy.
    """
    if not recipe.start:
        return None
    if not fits(recipe.start, recipe):
        raise CommandError(
            f"start = {recipe.start!r} is no network of {SHARED} that sees and acts as {recipe.name!r} does: leave "
            f"start out, or name zoo:... of a run with the same {', '.join(SAME)}"
        )
    card, network = load(parsed(recipe.start).name)
    assert isinstance(network, Network)
    scaled = card.observation_size - sum(card.actions) * (1 + card.wiring["masked"])  # the rest: last action, masks
    mean, deviation = (tuple(each[:scaled].tolist()) for each in (network.mean, network.deviation))
    return Start(recipe.start, network, (mean, deviation))


def fits(reference: str, recipe: Recipe) -> bool:
    """Whether a policy is a network that sees and acts as the recipe's does, so that learning can begin with it."""
    card = card_of(reference)
    if card is None or card.algorithm != SHARED or not card.wiring or parsed(reference).options:
        return False
    return set(SAME).isdisjoint(differing(card.recipe, knobs_of(recipe)))
