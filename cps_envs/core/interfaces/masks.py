"""Action masks as a function that exists only where there are any."""

from __future__ import annotations

from collections.abc import Callable

from cps_envs.core.game.game import Game
from cps_envs.core.learning.side import Side
from cps_envs.core.types import BoolArray, Role


def masks_of(side: Side, game: Game, role: Role, check: Callable[[], None]) -> Callable[[], BoolArray]:
    """A function that calls `check` and returns the legal actions of the rows (B x rows, k).

    Raises:
        AttributeError: there are no masks: everything in the action space is legal.
    """
    if not side.masked:
        raise AttributeError(f"the {role} of {game.name!r} has no action masks: all its actions are legal")

    def masks() -> BoolArray:
        check()
        found = side.masks()
        assert found is not None
        return found

    return masks
