"""A first policy by imitation: the likelihood of a teacher's actions is maximised before learning by reward.

For networks that remember, a teacher speaks of whole episodes, and imitation goes over them: the loss goes through the
recurrent network's memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from safetensors.numpy import save as to_bytes
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

from cps_agents.files import replacing
from cps_agents.learning.checkpoint import damaged, read_arrays
from cps_agents.learning.demonstrations import Commented, Demonstrations, comment
from cps_agents.learning.recipe import Recipe
from cps_envs.core.policy import Policy
from cps_envs.core.types import Array, BoolArray, IntArray


@dataclass(frozen=True)
class Sequences:
    """E episodes of single agents, of at most T decisions; what is beyond an episode's end is zero."""

    observations: Array  # (E, T, n)
    actions: Array  # (E, T, k)
    valid: BoolArray  # (E, T) where an episode still runs
    masks: BoolArray | None  # (E, T, m) legal actions

    @property
    def decisions(self) -> int:
        """All that have a label."""
        return int(self.valid.sum())


def collect(recipe: Recipe, seeds: Sequence[int], student: Policy | None = None) -> Sequences:
    """The teacher's answers in one episode per seed; the student, if there is one, acts in its place."""
    return joined([_sequences(commented) for commented in comment(recipe, seeds, student)])


def joined(parts: Sequence[Sequences]) -> Sequences:
    """All episodes, one part after the other; the shorter parts are filled up."""
    longest = max(part.valid.shape[1] for part in parts)
    masks = [part.masks for part in parts if part.masks is not None]
    return Sequences(
        _stacked([part.observations for part in parts], longest),
        _stacked([part.actions for part in parts], longest),
        _stacked([part.valid for part in parts], longest),
        _stacked(masks, longest) if len(masks) == len(parts) else None,
    )


def write_sequences(path: Path, shown: Sequences) -> None:
    """Keep them in a file, whole or not at all."""
    arrays = {"observations": shown.observations, "actions": shown.actions, "valid": shown.valid}
    if shown.masks is not None:
        arrays["masks"] = shown.masks
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as draft:
        draft.write_bytes(to_bytes({name: np.ascontiguousarray(array) for name, array in arrays.items()}))


def read_sequences(path: Path) -> Sequences:
    """What `write_sequences` has kept.

    Raises:
        CommandError: the file is missing or damaged.
    """
    found = read_arrays(path)
    try:
        return Sequences(found["observations"], found["actions"], found["valid"], found.get("masks"))
    except KeyError as error:
        raise damaged(path, f"{error} is missing") from error


def _sequences(commented: Commented) -> Sequences:
    """Sorts what was seen, decision by decision, into episodes."""
    decisions = commented.decisions()
    count = 1 + max(int(rows.max()) for *_, rows in decisions)
    first, actions, masks, _ = decisions[0]
    shape = (count, len(decisions))
    width = int(np.prod(actions.shape[1:], dtype=np.int64))
    found = Sequences(
        np.zeros((*shape, first.shape[1]), first.dtype),
        np.zeros((*shape, width), actions.dtype),
        np.zeros(shape, np.bool_),
        None if masks is None else np.ones((*shape, masks.shape[1]), np.bool_),
    )
    for place, (seen, played, legal, rows) in enumerate(decisions):
        found.observations[rows, place] = seen
        found.actions[rows, place] = played.reshape(len(rows), width)
        found.valid[rows, place] = True
        if found.masks is not None and legal is not None:
            found.masks[rows, place] = legal
    return found


def _stacked(arrays: Sequence[Array], longest: int) -> Array:
    filled = [np.pad(each, [(0, 0), (0, longest - each.shape[1])] + [(0, 0)] * (each.ndim - 2)) for each in arrays]
    return np.concatenate(filled)


LEARNING_RATE = 1e-3


def imitate(policy: Any, shown: Demonstrations, recipe: Recipe, generator: np.random.Generator) -> float:
    """Fit the policy network; returns the last epoch's mean loss. The deviation of Gaussian actions is left alone."""
    weights = [weight for name, weight in policy.named_parameters() if name != "log_std"]
    steps = recipe.teacher_epochs * -(-len(shown.actions) // recipe.batch_size)
    optimizer = torch.optim.Adam(weights, lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, max(steps, 1))
    losses: list[float] = []
    for _ in range(recipe.teacher_epochs):
        losses = []
        for rows in _batches(len(shown.actions), recipe.batch_size, generator):
            loss = likelihood_loss(policy, shown, rows)
            optimizer.zero_grad()
            torch.autograd.backward(loss)
            optimizer.step()
            schedule.step()
            losses.append(float(loss.detach()))
    return float(np.mean(losses))


def likelihood_loss(policy: Any, shown: Demonstrations, rows: np.ndarray[Any, Any]) -> torch.Tensor:
    """How unlikely the policy finds the actions of some rows; for Gaussian actions, how far off it is."""
    observations = torch.as_tensor(shown.observations[rows], device=policy.device)
    actions = torch.as_tensor(shown.actions[rows], device=policy.device)
    extra = {}
    if shown.masks is not None and isinstance(policy, MaskableActorCriticPolicy):
        extra["action_masks"] = shown.masks[rows]
    distribution = policy.get_distribution(observations, **extra)
    if actions.is_floating_point():
        return torch.nn.functional.mse_loss(distribution.distribution.mean, actions.float())
    likelihood: torch.Tensor = distribution.log_prob(actions)
    return -likelihood.mean()


def _batches(count: int, size: int, generator: np.random.Generator) -> Iterator[np.ndarray[Any, Any]]:
    order = generator.permutation(count)
    for start in range(0, count, size):
        yield order[start : start + size]


WHOLE_EPISODES_RATE = 4e-3
MAX_GRAD_NORM = 1.0
ACTOR = ("lstm_actor", "mlp_extractor.policy_net", "action_net")
SHARPNESS = 32.0  # of actions at their bounds: what is played is nearly the sign of the output that was learned
ILLEGAL = -1e8  # logit


def imitate_sequences(policy: Any, shown: Sequences, recipe: Recipe, generator: np.random.Generator) -> float:
    """Fit memory and layers of a RecurrentPPO's policy; returns the last epoch's mean loss.

    With the logistic loss of continuous actions the fitted policy plays `SHARPNESS` times its output: half an effort,
    where it is in doubt between two full ones, is not what the teacher does.
    """
    sharpness = SHARPNESS if isinstance(policy.action_space, spaces.Box) and recipe.teacher_loss == "logistic" else 1.0
    _scale_outputs(policy, 1 / sharpness)
    weights = [weight for name, weight in policy.named_parameters() if name.startswith(ACTOR)]
    episodes, length = shown.valid.shape
    size = max(recipe.batch_size // length, 1)
    optimizer = torch.optim.Adam(weights, lr=WHOLE_EPISODES_RATE)
    steps = recipe.teacher_epochs * -(-episodes // size)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, max(steps, 1))
    losses: list[float] = []
    for _ in range(recipe.teacher_epochs):
        losses = []
        order = generator.permutation(episodes)
        for start in range(0, episodes, size):
            loss = sequence_loss(policy, shown, order[start : start + size], recipe.teacher_loss)
            optimizer.zero_grad()
            torch.autograd.backward(loss)
            torch.nn.utils.clip_grad_norm_(weights, MAX_GRAD_NORM)
            optimizer.step()
            schedule.step()
            losses.append(float(loss.detach()))
    _scale_outputs(policy, sharpness)
    return float(np.mean(losses))


def _scale_outputs(policy: Any, factor: float) -> None:
    """By a power of two, so that scaling there and back changes no bit."""
    with torch.no_grad():
        policy.action_net.weight.mul_(factor)
        policy.action_net.bias.mul_(factor)


def sequence_loss(policy: Any, shown: Sequences, rows: IntArray, kind: str) -> torch.Tensor:
    """The mean over all decisions of some episodes: cross-entropy of discrete actions, for continuous ones by `kind`.

    "squared": how far off the mean action is. "logistic": the action as a coin that falls on the upper bound, whose
    log-odds are twice the network's output. For actions at their bounds that is sharper, and what it plays is clipped.
    """
    valid = torch.as_tensor(shown.valid[rows])
    outputs = outputs_of(policy, torch.as_tensor(shown.observations[rows]))[valid]
    actions = torch.as_tensor(shown.actions[rows])[valid]
    if isinstance(policy.action_space, spaces.Box):
        if kind == "squared":
            return torch.nn.functional.mse_loss(outputs, actions.float())
        return torch.nn.functional.binary_cross_entropy_with_logits(2 * outputs, (actions.float() + 1) / 2)
    if shown.masks is not None:
        outputs = outputs.masked_fill(~torch.as_tensor(shown.masks[rows])[valid], ILLEGAL)
    counts = np.ravel(getattr(policy.action_space, "nvec", getattr(policy.action_space, "n", 0))).tolist()
    parts = torch.split(outputs, counts, dim=1)
    losses = [torch.nn.functional.cross_entropy(part, actions[:, k].long()) for k, part in enumerate(parts)]
    return torch.stack(losses).mean()


def outputs_of(policy: Any, observations: torch.Tensor) -> torch.Tensor:
    """Means or logits (E, T, outputs) of a RecurrentPPO's policy in whole episodes (E, T, n)."""
    episodes, length, _ = observations.shape
    extractor = getattr(policy, "pi_features_extractor", policy.features_extractor)
    features = extractor(observations.flatten(0, 1)).unflatten(0, (episodes, length))
    remembered, _ = policy.lstm_actor(features.transpose(0, 1))
    outputs: torch.Tensor = policy.action_net(policy.mlp_extractor.forward_actor(remembered)).transpose(0, 1)
    return outputs
