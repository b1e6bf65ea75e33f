"""Action masks as a function that exists only where there are any."""

from __future__ import annotations

from collections.abc import Callable

from cps_envs.core.game.game import Game
from cps_envs.core.types import BoolArray, Role


def masks_of(game: Game, role: Role) -> Callable[[], BoolArray]:
    """A function that returns the legal actions (B, k) of a role.

    Raises:
        AttributeError: the role has no masks: everything in its action space is legal.
    """
    if game.action_mask(role) is None:
        raise AttributeError(f"the {role} of {game.name!r} has no action masks: all its actions are legal")

    def masks() -> BoolArray:
        found = game.action_mask(role)
        assert found is not None
        return found

    return masks
