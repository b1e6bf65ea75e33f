"""Where policies are evaluated: a configuration, an opponent, and how many episodes on the evaluation seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cps_agents.benchmark.cell import Cell, Result, problem_of
from cps_agents.zoo.references import by_training_seed, form_of, weights_of
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import FloatArray, Role, other
from cps_envs.registration import PROBLEMS


@dataclass(frozen=True)
class Arena:
    """One role is evaluated against a fixed opponent, on the seeds 0, 1, ..., which training never sees."""

    problem: str  # name, or module:attribute of a problem that is not registered
    role: Role
    opponent: str
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)
    episodes: int = 50
    name: str = ""  # for file names

    @property
    def config(self) -> Any:
        """The configuration."""
        return problem_of(self.problem).config(self.preset, self.overrides)

    def cells(
        self, policy: str, name: str = "", episodes: int = 0, overrides: Mapping[str, Any] | None = None
    ) -> list[Cell]:
        """One piece of work for each training seed of a policy; one where it has none.

        Trained policies, of either side, are given the observation and action form that they were trained with.
        """
        own = {**self.overrides, **(overrides or {})}
        if self.problem in PROBLEMS:
            config = self.config
            own |= {**form_of(self.opponent, config), **form_of(policy, config)}
        cells = []
        for seed, reference in by_training_seed(policy).items():
            label = f"{name or policy}{'' if seed is None else f' seed {seed}'}"
            players = {self.role: (label, reference), other(self.role): (self.opponent, self.opponent)}
            cells.append(
                Cell(
                    problem=self.problem,
                    setting=self.name,
                    preset=self.preset,
                    overrides=own,
                    attacker=players["attacker"][0],
                    defender=players["defender"][0],
                    attacker_policy=players["attacker"][1],
                    defender_policy=players["defender"][1],
                    episodes=episodes or self.episodes,
                    weights=weights_of(reference) | weights_of(self.opponent),
                )
            )
        return cells


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
