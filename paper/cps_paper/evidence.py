"""The results of experiments, and computing them in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeAlias, TypeVar

from cps_agents.workers import Where, Workers

Result = TypeVar("Result", covariant=True)
Own = TypeVar("Own", bound="Evidence")
Report = Callable[[float, str], None]  # share of the work done, what was finished last


class Experiment(Hashable, Protocol[Result]):
    """Anything that can be computed alone, in any process, and whose result is a plain value."""

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        ...

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        ...

    def run(self) -> Result:
        """Compute it."""
        ...


Vary: TypeAlias = Callable[[Experiment[Any]], Experiment[Any]]


class NotRunError(LookupError):
    """The experiment was left out of this run."""


def itself(experiment: Experiment[Any]) -> Experiment[Any]:
    """The usual experiment."""
    return experiment


@dataclass(frozen=True)
class Evidence:
    """Results by experiment; chapters add what they read them under."""

    results: Mapping[Experiment[Any], Any] = field(default_factory=dict)
    quick: bool = False  # less was computed
    vary: Vary = itself  # gives the experiment that stands in for another one

    def __getitem__(self, experiment: Experiment[Result]) -> Result:
        """The result of an experiment; NotRunError where it was left out."""
        found = self.vary(experiment)
        if found not in self.results:
            raise NotRunError(experiment.label)
        result: Result = self.results[found]
        return result

    def varied(self: Own, vary: Vary) -> Own:
        """The same results, where further experiments stand in for those that are asked for."""
        return replace(self, vary=lambda experiment: self.vary(vary(experiment)))


def compute(
    experiments: Iterable[Experiment[Any]], jobs: Where = 1, report: Report | None = None
) -> dict[Experiment[Any], Any]:
    """Run every distinct experiment once, the long ones first, by so many processes (1: this one) or by a cluster."""
    todo = sorted(dict.fromkeys(experiments), key=lambda experiment: -experiment.cost)
    total, done = sum(experiment.cost for experiment in todo), 0.0
    results = {}
    with Workers(jobs, len(todo)) as workers:
        for experiment, result in workers.run(_run, todo):
            results[experiment] = result
            done += experiment.cost
            if report is not None:
                report(done / total, experiment.label)
    return results


def _run(experiment: Experiment[Any]) -> Any:
    return experiment.run()
