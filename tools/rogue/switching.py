"""The seeded search that found the weights of `switching`: evolution strategy with covariance adaptation.

`python -m tools.rogue.search --out switching.json` made the file `switching.json` of `cps_baselines.rogue`.

A search at a fixed step in one world finds the chatter of its integration: against detection, twice the step seemed to
give ten times the damage. So every candidate is judged in several worlds whose drive and drag differ by up to 0.3 %,
drawn anew in each generation; the best of the generations are judged again at half the step; and the reported damage
comes from worlds that the search has not seen.

What is found against all defenders at once also starts a run against each of them: against detection alone the search
stays where nothing happens, since damage begins only after a long way through harmless attackers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cps_baselines.rogue.switching import SIZE
from cps_envs.core.types import FloatArray
from cps_paper.rogue.worlds import ALL, REPORTED, switching_damages
from tools.evolving import evolve

DEFENDERS = ("pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")
SEARCHED, SELECTED = 10_000_000, 20_000_000  # first seeds of the worlds
Report = Callable[[str], None]


@dataclass(frozen=True)
class SwitchingSearch:
    """What is searched for; every field is written into the result."""

    against: str  # a registered defender, or `ALL`: the mean over DEFENDERS
    power_ratio: float
    generations: int = 30
    population: int = 24  # candidates per generation
    restarts: int = 2  # from zero, each with other draws
    spread: float = 1.0  # initial standard deviation of a weight where a run starts at zero
    start: tuple[float, ...] = ()  # weights that a further run starts at; their length does not matter
    start_spread: float = 0.5  # the same there, with `start` at a length of sqrt(7)
    worlds: int = 3  # in which a candidate is judged
    finalists: int = 16  # judged again in more worlds and at half the step
    final_worlds: int = 8
    seed: int = 0

    @property
    def defenders(self) -> Sequence[str]:
        """Who is played against."""
        return DEFENDERS if self.against == ALL else (self.against,)

    @property
    def runs(self) -> int:
        """Of the evolution strategy."""
        return self.restarts + bool(self.start)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.against}, ratio {self.power_ratio:g}"

    def damages(self, weights: FloatArray, first: int, count: int, **options: Any) -> FloatArray:
        """Damages (P, defenders, worlds) in m/s of candidates (P, 7), see `switching_damages`."""
        seeds = range(first, first + count)
        return switching_damages(weights, self.defenders, self.power_ratio, seeds, **options)


def search_switching(search: SwitchingSearch) -> dict[str, Any]:
    """The best weights (7,) with their damage in m/s, ready for JSON.

    `damage` is that of the unperturbed world at the step of the preset; `verified` is the mean, and `deviation` the
    standard deviation, at half the step over worlds that the search has not seen.
    """
    champions = [pair for run in range(search.runs) for pair in _generations(search, run)]
    best = sorted(champions, key=lambda pair: -pair[0])[: search.finalists]
    finalists = np.array([weights for _, weights in best])
    judged = search.damages(finalists, SELECTED, search.final_worlds, refined=True)
    weights = np.round(finalists[np.argmax(judged.mean(axis=(1, 2)))], 4)
    unseen = search.damages(weights[np.newaxis], REPORTED, 2 * search.final_worlds, refined=True)[0]
    return {
        "against": search.against,
        "power_ratio": search.power_ratio,
        "weights": weights.tolist(),
        "damage": _rounded(search.damages(weights[np.newaxis], 0, 1, spread=0.0).mean()),
        "verified": _rounded(unseen.mean()),
        "deviation": _rounded(unseen.mean(axis=0).std()),
        "search": asdict(search),
    }


def _generations(search: SwitchingSearch, run: int) -> Iterator[tuple[float, FloatArray]]:
    """The best candidate of each generation with its damage."""
    origin, spread = np.zeros(SIZE), search.spread
    if run == search.restarts:
        origin, spread = np.array(search.start), search.start_spread
        origin *= np.sqrt(SIZE) / np.linalg.norm(origin)

    def judge(candidates: FloatArray, generation: int) -> FloatArray:
        first = SEARCHED + (run * search.generations + generation) * search.worlds
        damages: FloatArray = search.damages(candidates, first, search.worlds).mean(axis=(1, 2))
        return damages

    sizes = {"population": search.population, "generations": search.generations}
    yield from evolve(judge, origin, spread, **sizes, seed=[search.seed, run])


def _rounded(damage: float) -> float:
    return round(float(damage), 2)
