"""The search behind `probing.json`: a probe for each power ratio, and the best answer to each controller after it.

`python -m tools.rogue.search --probe --out probing.json` made the file. Its row of 1.1 was searched anew, with `--again
--ratio 1.1 --seed 1`, and names its search. Every candidate starts in the state that the probe has led to. The searches
begin at the laws that did most there of all that the package knows, whatever they were found against: from zero a
search against detection stays where nothing happens.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from cps_baselines.rogue.identify import known
from cps_baselines.rogue.probing import LOOKS_S, Answers, Probe, shipped_answers, trace_of
from cps_baselines.rogue.switching import SIZE, Switching, shipped_weights
from cps_baselines.workers import Workers
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, IntArray, Role
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_paper.rogue.worlds import ALL, REPORTED, world_config
from tools.evolving import evolve
from tools.rogue.switching import DEFENDERS, SEARCHED, SELECTED
from tools.rogue.yardsticks import RATIOS as YARDSTICK_RATIOS
from tools.rogue.yardsticks import shipped

RATIOS = (1.0, 1.05, 1.1, 1.15, 1.2, 1.3)
ALIKE = ("disband_4", "disband_7")  # told apart late, at some ratios never: they get one answer
PROBES = ("disband_4", "sliding_detection", ALL)  # controllers whose laws are tried as probes
LATER = 1.1  # below this power ratio the disbanders are told apart only at the last look
Found = dict[str, Any]


@dataclass(frozen=True)
class ProbingSearch:
    """How long a search takes; every field is written into the result."""

    generations: int = 12
    population: int = 16
    starts: int = 3  # laws that a run begins at
    spread: float = 0.5  # initial standard deviation, with the start at a length of sqrt(7)
    worlds: int = 2  # in which a candidate is judged
    finalists: int = 10
    final_worlds: int = 8  # at half the step
    above: float = 0.02  # power ratios up to so much higher are drawn, between the first ratio and the last
    seed: int = 0


AGAIN = ProbingSearch(generations=20, worlds=3, spread=0.4, finalists=12, above=0.01)  # longer, nearer to the ratio


@dataclass(frozen=True)
class Job:
    """An answer to search; plain data that any process can do."""

    ratio: float
    defenders: tuple[str, ...]  # that get one answer
    probe: tuple[float, ...]
    search: ProbingSearch
    laws: tuple[tuple[float, ...], ...] = ()  # further laws to begin at; the first is among those judged in the end


def answer_at(defender: str, ratio: float) -> int:
    """The look from which on a controller is answered."""
    if defender == "pd":
        return 0
    return 2 if defender.startswith("disband") and ratio < LATER else 1


def pool() -> FloatArray:
    """Every law (N, 7) that the package knows, at a length of sqrt(7)."""
    laws = [*shipped_weights().values(), *known().weights]
    laws += [np.array(cell["weights"]) for cell in shipped().values() if "weights" in cell]
    return _scaled(np.array(laws))


def choose_probe(ratio: float, search: ProbingSearch) -> tuple[float, ...]:
    """Of some laws (7,) the one after which the package's laws do most damage, over all controllers in the mean."""
    laws, yardsticks = pool(), shipped()
    candidates = [weights for (name, _), weights in shipped_weights().items() if name in PROBES]
    nearest = min(YARDSTICK_RATIOS, key=lambda each: abs(each - ratio))
    candidates += [np.array(yardsticks[f"switching {nearest:g} {name}"]["weights"]) for name in PROBES if name != ALL]
    values = [
        np.mean([damages(laws, probe, name, ratio, [SEARCHED], search).max() for name in DEFENDERS])
        for probe in candidates
    ]
    return tuple(candidates[int(np.argmax(values))].tolist())


def search_answer(job: Job) -> dict[str, Found]:
    """The law that hurts some controllers most in the mean after the probe, for each of them, ready for JSON.

    `damage` is the mean at half the step over worlds that the search has not seen.
    """
    search = job.search

    def values(candidates: FloatArray, seeds: Sequence[int], *, fine: bool = False) -> FloatArray:
        each = [damages(candidates, start, name, job.ratio, seeds, search, fine=fine) for name in job.defenders]
        means: FloatArray = np.mean(each, axis=(0, 2))
        return means

    start = np.array(job.probe)
    laws = np.concatenate([_scaled(np.array(job.laws)), pool()]) if job.laws else pool()
    screened = values(laws, range(SELECTED - search.worlds, SELECTED))
    origins = laws[np.argsort(-screened, kind="stable")[: search.starts]]
    champions = [*laws[: bool(job.laws)], *origins]
    for run, origin in enumerate(origins):

        def judge(candidates: FloatArray, generation: int, run: int = run) -> FloatArray:
            place = SEARCHED + (run * search.generations + generation) * search.worlds
            return values(candidates, range(place, place + search.worlds))

        sizes = {"population": search.population, "generations": search.generations}
        runs = evolve(judge, origin, search.spread, **sizes, seed=[search.seed, run])
        champions += [weights for _, weights in runs][-search.finalists // search.starts :]
    judged = values(np.array(champions), range(SELECTED, SELECTED + search.final_worlds), fine=True)
    weights = np.round(champions[int(judged.argmax())], 4)
    return {name: _answer(name, weights, job) for name in job.defenders}


def _answer(defender: str, weights: FloatArray, job: Job) -> Found:
    search, start = job.search, np.array(job.probe)
    unseen = range(REPORTED, REPORTED + 2 * search.final_worlds)
    verified = damages(weights[np.newaxis], start, defender, job.ratio, unseen, search, fine=True)
    return {
        "answer_s": LOOKS_S[answer_at(defender, job.ratio)],
        "weights": weights.tolist(),
        "damage": round(float(verified.mean()), 2),
        "traces": np.round(mean_traces(defender, job.ratio, start, search), 4).tolist(),
    }


def damages(
    laws: FloatArray,
    probe: FloatArray,
    defender: str,
    ratio: float,
    seeds: Sequence[int],
    search: ProbingSearch,
    *,
    fine: bool = False,
) -> FloatArray:
    """Damages (P, worlds) in m/s of answers (P, 7) to one controller after a probe (7,)."""
    config = _config(ratio, search, fine=fine)
    at: IntArray = np.full((1, len(laws)), answer_at(defender, ratio))
    traces = np.zeros((1, len(laws), len(LOOKS_S), 5))
    answers = Answers((), np.ones(1), probe[np.newaxis], laws[np.newaxis], at, traces)
    rows: IntArray = np.repeat(np.arange(len(laws)), len(seeds))
    attacker = Probe(ROGUE.game(config, 1).spec("attacker"), answers=answers, row=rows)
    players: dict[Role, Any] = {"attacker": attacker, "defender": defender}
    found: FloatArray = play_episodes(ROGUE, config, players, list(seeds) * len(laws))["damage"]
    return found.reshape(len(laws), -1)


def mean_traces(defender: str, ratio: float, probe: FloatArray, search: ProbingSearch) -> FloatArray:
    """What the attacker sees in the mean (looks, 5) at each look if it only probes."""
    config, traces = _config(ratio, search), list[FloatArray]()
    looks = {round(look_s / config.control_period_s) for look_s in LOOKS_S}

    def look(game: Game) -> None:
        if game.elapsed[0] in looks:
            traces.append(trace_of(Seen(game.fields["attacker"], game.observe("attacker"))).mean(axis=0))

    players: dict[Role, Any] = {"attacker": Switching(ROGUE.game(config, 1).spec("attacker"), probe)}
    seeds = range(SELECTED, SELECTED + search.final_worlds)
    play_episodes(ROGUE, config, {**players, "defender": defender}, seeds, on_step=look)
    return np.array(traces)


def search_answers(
    ratios: Sequence[float],
    search: ProbingSearch,
    workers: Workers,
    report: Callable[[int, str, Found], None],
    *,
    again: bool = False,
) -> Found:
    """Everything that `Probe` needs, ready for JSON; each answer is searched twice, at last from those of all.

    `again` begins at the answers that come with the package, and keeps their probes: at its power ratios only.
    `report` is told after each search how many controllers are done, what is new, and what has been found so far.
    """
    if again:
        known, probes = _begun(ratios)
    else:
        known, probes = {}, dict(workers.run(partial(choose_probe, search=search), list(ratios)))
    alone = [(name,) for name in DEFENDERS]
    found: dict[tuple[float, str], Found] = {}
    done = 0
    for groups in (alone, [*(group for group in alone if group[0] not in ALIKE), ALIKE]):
        jobs = [
            Job(ratio, group, probes[ratio], search, _laws({**known, **found}, ratio, group))
            for ratio in ratios
            for group in groups
        ]
        fresh = {}
        for job, cells in workers.run(search_answer, jobs):
            fresh.update({(job.ratio, name): cell for name, cell in cells.items()})
            done += len(cells)
            reached = " and ".join(f"{name} {cell['damage']:.1f} m/s" for name, cell in cells.items())
            report(done, f"ratio {job.ratio:g}: {reached}", _document({**found, **fresh}, probes, ratios, search))
        found = fresh
    return _document(found, probes, ratios, search)


def _begun(ratios: Sequence[float]) -> tuple[dict[tuple[float, str], Found], dict[float, tuple[float, ...]]]:
    """The weights of all answers that come with the package, and the probes at some of its power ratios."""
    known = shipped_answers()
    rows = {ratio: row for row, ratio in enumerate(known.ratios.tolist())}
    found = {
        (ratio, name): {"weights": known.weights[row, column].tolist()}
        for ratio, row in rows.items()
        for column, name in enumerate(known.against)
    }
    return found, {ratio: tuple(known.probes[rows[ratio]].tolist()) for ratio in ratios}


def _laws(
    found: Mapping[tuple[float, str], Found], ratio: float, group: tuple[str, ...]
) -> tuple[tuple[float, ...], ...]:
    """The weights of all answers so far, those to the group at this ratio first."""
    own = [found[ratio, name] for name in group if (ratio, name) in found]
    return tuple(tuple(cell["weights"]) for cell in [*own, *found.values()])


def _document(
    found: Mapping[tuple[float, str], Found],
    probes: Mapping[float, tuple[float, ...]],
    ratios: Sequence[float],
    search: ProbingSearch,
) -> Found:
    """What has been found, ratio by ratio; only ratios with all their answers."""
    rows = []
    for ratio in ratios:
        answers = {name: found[ratio, name] for name in DEFENDERS if (ratio, name) in found}
        if len(answers) == len(DEFENDERS):
            rows.append({"power_ratio": ratio, "probe": list(probes[ratio]), "answers": answers})
    return {"search": asdict(search), "found": rows}


def _config(ratio: float, search: ProbingSearch, *, fine: bool = False) -> RogueConfig:
    inside = RATIOS[0] < ratio < RATIOS[-1]
    return world_config((ratio, ratio + search.above) if inside else ratio, refined=fine)


def _scaled(laws: FloatArray) -> FloatArray:
    """At the length at which searches begin, which a law's play does not depend on."""
    scaled: FloatArray = laws * np.sqrt(SIZE) / np.linalg.norm(laws, axis=1, keepdims=True)
    return scaled
