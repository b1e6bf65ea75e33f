"""One role against a fixed opponent, on the seeds 0, 1, ..., which training never sees, and what it scores there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_agents.arena.meeting import Result
from cps_agents.arena.play import Pairing
from cps_baselines.arena import Contestant, Venue
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import FloatArray, Role


@dataclass(frozen=True)
class Challenge:
    """A role faces an opponent in a venue."""

    venue: Venue
    role: Role
    opponent: str  # reference
    episodes: int = 50

    @property
    def config(self) -> Any:
        """The configuration."""
        return self.venue.config

    def pairing(self, contestant: Contestant, episodes: int = 0) -> Pairing:
        """The contestant, a trained one with every training seed, against the opponent."""
        rival = Contestant(self.opponent)
        attacker, defender = (contestant, rival) if self.role == "attacker" else (rival, contestant)
        return Pairing(self.venue, attacker, defender, episodes or self.episodes, every_seed=self.role)


HAPPENED = ">0"  # after a metric's name: 100 in episodes in which it is above zero, 0 in others


def scores(results: Sequence[Result], metric: str, per: str = "") -> FloatArray:
    """A metric (training seeds, episodes), divided episode by episode by another one if `per` names it.

    The mean of "collided>0" is the percentage of episodes in which `collided` is above zero.

    Raises:
        UnknownNameError: the episodes have no such metric.
        ValueError: the divisor is 0 in some episode.
    """
    if metric.endswith(HAPPENED):
        return np.where(scores(results, metric.removesuffix(HAPPENED)) > 0, 100.0, 0.0)
    for name in (metric, *([per] if per else [])):
        if name not in results[0]["metrics"]:
            raise UnknownNameError(f"there is no metric {name!r}. {near(name, results[0]['metrics'])}")
    values = np.array([result["metrics"][metric] for result in results], np.float64)
    if not per:
        return values
    divisors = np.array([result["metrics"][per] for result in results], np.float64)
    if not divisors.all():
        raise ValueError(f"{per} is 0 in some episode: there is nothing to compare {metric} with")
    share: FloatArray = values / divisors
    return share
