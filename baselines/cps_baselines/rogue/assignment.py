"""Fixed assignments of laws to vehicles."""

from __future__ import annotations

import numpy as np

from cps_baselines.rogue.controllers import require_modes
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, IntArray, State
from cps_envs.rogue.actions import MODIFIED, PLAIN
from cps_envs.rogue.controllers import CONTROLLERS

LETTERS = {name[0]: index for index, name in enumerate(CONTROLLERS)}


def laws_of(letters: str, option: str) -> IntArray:
    """Controller and modification (k, 2) of each letter: the first of a controller's name, a capital for modified.

    Raises:
        ConfigurationError: a letter that no controller begins with.
    """
    wrong = sorted({letter for letter in letters if letter.lower() not in LETTERS})
    if wrong or not letters:
        known = ", ".join(f"{letter} ({CONTROLLERS[index]})" for letter, index in LETTERS.items())
        raise ConfigurationError(
            f"{option} = {letters!r} has to be made of {known}, or capitals for modified following"
        )
    rows = [(LETTERS[letter.lower()], MODIFIED if letter.isupper() else PLAIN) for letter in letters]
    return np.array(rows, np.int64)


class Assigned(AnalyticPolicy):
    """Gives each vehicle one law for good, from the rear: `assigned?laws=shll` is sliding, human, linear, linear.

    Platoons with more or fewer vehicles get the same pattern stretched, with its ends at the ends: of k letters, the
    vehicle i of n (from 0) has the one at i (k - 1) / (n - 1), rounded.

    Raises:
        ConfigurationError: an unknown letter, or an environment that takes accelerations.
    """

    def __init__(self, spec: RoleSpec, laws: str = "ssslll") -> None:
        super().__init__(spec)
        require_modes(spec, self)
        pattern, longest = laws_of(laws, "laws"), spec.config.num_orders
        self.tables = np.zeros((longest + 1, longest, 2), np.int64)  # by the number of vehicles with orders
        for count in range(1, longest + 1):
            places = np.arange(count) * (len(pattern) - 1) / max(count - 1, 1)
            self.tables[count, :count] = pattern[np.rint(places).astype(np.int64)]

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The controllers (B, 2 k) of the k vehicles that get orders."""
        return self.tables[ordered(seen, self.spec)].reshape(len(seen), -1), state


def ordered(seen: Seen, spec: RoleSpec) -> IntArray:
    """How many vehicles get orders in each episode (B,)."""
    longest = int(spec.config.num_orders)
    if "present" not in seen:
        return np.full(len(seen), longest)
    present = seen["present"]
    counts: IntArray = longest - present.shape[1] + np.rint(present.sum(axis=1)).astype(np.int64)
    return counts
