"""Arguments that several interfaces take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from cps_envs.core.compute.generators import seeded
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.types import BoolArray, Generators

Seeds: TypeAlias = int | Sequence[int | None] | None


def check_autoreset(mode: str | AutoresetMode) -> AutoresetMode:
    """When an ended environment starts again: "same_step", "next_step", "disabled", or Gymnasium's own member.

    Raises:
        ConfigurationError: there is no such mode.
    """
    if isinstance(mode, AutoresetMode):
        return mode
    known = {each.name.lower(): each for each in AutoresetMode} | {each.value: each for each in AutoresetMode}
    if not isinstance(mode, str) or mode not in known:
        raise ConfigurationError(f"autoreset = {shown(mode)} must be one of same_step, next_step, disabled")
    return known[mode]


def check_seed(seed: Any) -> int | None:
    """The seed of one episode, or None.

    Raises:
        ValueError: it is no whole number from 0 on.
    """
    if seed is None:
        return None
    if isinstance(seed, (bool, np.bool_)) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"seed = {shown(seed)} must be a whole number from 0 on, or None")
    return int(seed)


def check_mask(mask: Any, num_envs: int, *, begun: bool, alike: bool) -> BoolArray:
    """The episodes (B,) that `options["reset_mask"]` marks.

    `begun`: all of them have been started before. `alike`: those that start play what the others play.

    Raises:
        ValueError: it is no boolean array with an entry for each episode, or marks none.
        ResetNeeded: it leaves out episodes that have never started, or that play what `configure` has replaced.
    """
    if not isinstance(mask, np.ndarray) or mask.shape != (num_envs,) or mask.dtype != np.bool_:
        raise ValueError(f'options["reset_mask"] must be a boolean numpy array of shape ({num_envs},)')
    if not mask.any():
        raise ValueError('options["reset_mask"] marks no environment')
    if not begun and not mask.all():
        raise ResetNeeded("the first reset() has to start every environment: leave out the reset_mask")
    if not alike and not mask.all():
        raise ResetNeeded("the reset() after configure() has to start every environment: leave out the reset_mask")
    return mask


def reseeded(generators: Generators, seed: Seeds, envs: BoolArray) -> Generators:
    """The generators (B,) of episodes, new ones for those of the marked ones (B,) that have a seed, or had none yet.

    Raises:
        ValueError: `seed` is not one whole number, one for each episode, or None.
    """
    num_envs, seeds = len(envs), _seeds_of(seed, len(envs))
    wanted = [b for b in np.flatnonzero(envs).tolist() if not generators or seeds[b] is not None]
    if not wanted:
        return generators
    made: Generators = seeded([seeds[b] for b in wanted])  # all of them, or an error and none
    if len(wanted) == num_envs:
        return made
    new = dict(zip(wanted, made, strict=True))
    return [new.get(b) or generators[b] for b in range(num_envs)]


def _seeds_of(seed: Seeds, num_envs: int) -> Sequence[int | None]:
    """A seed for each episode, or None."""
    if seed is None:
        return [None] * num_envs
    if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
        return [int(seed) + i for i in range(num_envs)]
    if not isinstance(seed, (list, tuple, np.ndarray)):
        raise ValueError(f"seed = {shown(seed)} must be a whole number, one for each environment, or None")
    if len(seed) != num_envs:
        raise ValueError(f"one seed per environment is needed: {num_envs} environments, {len(seed)} seeds")
    for each in seed:
        if each is not None and (isinstance(each, (bool, np.bool_)) or not isinstance(each, (int, np.integer))):
            raise ValueError(f"seed = {shown(seed)}: {shown(each)} is no whole number, and not None")
    return [None if each is None else int(each) for each in seed]
