"""Names for the arrays and roles that the core passes around."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Role = Literal["attacker", "defender"]
ROLES: tuple[Role, Role] = ("attacker", "defender")
AGENTS: Mapping[Role, str] = {"attacker": "attacker_0", "defender": "defender_0"}
SIGN: Mapping[Role, float] = {"attacker": 1.0, "defender": -1.0}  # the attacker maximises the payoff

Array: TypeAlias = NDArray[Any]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]
FloatArray: TypeAlias = NDArray[np.float64]
Observation: TypeAlias = NDArray[np.float32]

State: TypeAlias = tuple[Array, ...]  # of a policy: arrays with a leading environment axis
Generators: TypeAlias = Sequence[np.random.Generator]  # one for each episode that starts


class Known(Protocol):
    """What a privileged policy knows of an episode, by name; see `core.game.match.Told`."""

    def __getitem__(self, name: str, /) -> Any: ...


Knowledge: TypeAlias = Sequence[Known]  # for each episode that starts


def other(role: Role) -> Role:
    """The opponent of a role."""
    return "defender" if role == "attacker" else "attacker"
