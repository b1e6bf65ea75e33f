"""What a teacher says of whole episodes, for networks that remember."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cps_agents.files import replacing
from cps_agents.learning.demonstrations import Commented, comment
from cps_agents.learning.recipe import Recipe
from cps_envs.core.policy import Policy
from cps_envs.core.types import Array, BoolArray


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
    with replacing(path) as draft, draft.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def read_sequences(path: Path) -> Sequences:
    """What `write_sequences` has kept.

    Raises:
        ValueError, OSError, KeyError, zipfile.BadZipFile: the file is damaged.
    """
    with np.load(path) as found:
        return Sequences(found["observations"], found["actions"], found["valid"], found.get("masks"))


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
