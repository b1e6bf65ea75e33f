"""Whether a result is one of the model, or one of its integration step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cps_envs.core.declare.config import configure
from cps_envs.core.game.play import play_episodes
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Role


@dataclass(frozen=True)
class Refinement:
    """The mean of a metric over the same episodes with the given configuration and with a refined one."""

    coarse: float
    fine: float
    floor: float  # differences are related to at least this

    @property
    def change(self) -> float:
        """Relative change by the refinement."""
        return abs(self.fine - self.coarse) / max(abs(self.coarse), self.floor)

    def __str__(self) -> str:
        return f"{self.coarse:.6g} becomes {self.fine:.6g}, a change of {self.change:.1%}"


def refine(
    problem: Problem,
    players: Mapping[Role, PolicyReference],
    refined: Mapping[str, Any],
    *,
    metric: str = "return",
    preset: str | None = None,
    seeds: Sequence[int] = (0,),
    floor: float = 1.0,
    **overrides: Any,
) -> Refinement:
    """Play the same episodes twice, the second time with the fields `refined` replaced, such as {"dt_s": 0.0005}.

    `metric` is a metric of the problem or the attacker's "return"; `overrides` are fields of both configurations.
    """
    config = problem.config(preset, overrides)
    coarse, fine = (
        float(play_episodes(problem, variant, players, seeds)[metric].mean())
        for variant in (config, configure(config, refined))
    )
    return Refinement(coarse, fine, floor)


def check_refinement(
    problem: Problem,
    players: Mapping[Role, PolicyReference],
    refined: Mapping[str, Any],
    *,
    tolerance: float = 0.1,
    **arguments: Any,
) -> Refinement:
    """`refine`, and refuse a change beyond `tolerance`: an attacker who lives on it exploits the integration.

    Raises:
        AssertionError: the mean of the metric changes by more.
    """
    found = refine(problem, players, refined, **arguments)
    named = {role: player if isinstance(player, str) else type(player).__name__ for role, player in players.items()}
    assert found.change <= tolerance, f"{problem.name}, {named}, refined by {dict(refined)}: {found} > {tolerance:.0%}"
    return found
