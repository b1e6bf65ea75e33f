"""`cps-envs search-switching`: the searches behind the weights of the rogue attacker `switching`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import err, print_json

PROBE = "Search what `probe` plays instead (20 CPU minutes). Takes --ratio, --seed, --jobs and --out."
AGAINST = "Defender, or all: the mean over those of chapter 5. May be repeated; default: everything."


def search_switching(
    against: Annotated[list[str] | None, typer.Option(help=AGAINST)] = None,
    ratio: Annotated[list[float] | None, typer.Option(help="Power ratio; may be repeated. Default: 1 and 1.3.")] = None,
    generations: Annotated[int, typer.Option(min=1, help="Generations of each restart.")] = 30,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 24,
    restarts: Annotated[int, typer.Option(min=1, help="Run so often independently; the best counts.")] = 2,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    jobs: Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")] = None,
    to: Annotated[Path | None, typer.Option("--out", help="Write to this file; default: stdout.")] = None,
    probe: Annotated[bool, typer.Option("--probe", help=PROBE)] = False,
) -> None:
    """Find the weights of the rogue attacker `switching` against each defender; the result is JSON.

    A run against one defender starts from what was found against all, or else from the weights of the package. After
    every search the file holds what has been found so far, so an interrupted run is not lost.
    """
    if probe:
        _search_answers(ratio, seed, jobs, to)
        return
    from cps_agents.files import write_json
    from cps_agents.machine import available_cores
    from cps_agents.progress import Progress
    from cps_baselines.rogue.switching import shipped_weights
    from cps_baselines.rogue.switching_search import ALL, DEFENDERS, RATIOS, SwitchingSearch, search_switching
    from cps_baselines.workers import Workers

    names, ratios = against or (ALL, *DEFENDERS), ratio or RATIOS
    starts = {known: tuple(weights.tolist()) for known, weights in shipped_weights().items()}
    found: dict[tuple[str, float], dict[str, Any]] = {}
    count = len(names) * len(ratios)
    with Progress("searches", count) as progress, Workers(min(jobs or available_cores(), count)) as pool:
        for stage in ([ALL] if ALL in names else [], [name for name in names if name != ALL]):
            searches = [
                SwitchingSearch(
                    name,
                    power_ratio,
                    generations,
                    population,
                    restarts,
                    start=() if name == ALL else starts.get((ALL, power_ratio), ()),
                    seed=seed,
                )
                for name in stage
                for power_ratio in ratios
            ]
            for search, result in pool.run(search_switching, searches):
                found[search.against, search.power_ratio] = result
                starts[search.against, search.power_ratio] = tuple(result["weights"])
                progress.update(len(found), f"{search.label}: {result['verified']:.1f} m/s")
                if to is not None:
                    write_json(to, document(found, names, ratios))
    if to is None:
        print_json(document(found, names, ratios))
        return
    err().print(f"{count} searches: {to}", soft_wrap=True)


def document(
    found: Mapping[tuple[str, float], dict[str, Any]], names: Sequence[str], ratios: Sequence[float]
) -> dict[str, Any]:
    """What has been found so far, in the order of the request."""
    return {"found": [found[name, ratio] for name in names for ratio in ratios if (name, ratio) in found]}


def _search_answers(ratio: list[float] | None, seed: int, jobs: int | None, to: Path | None) -> None:
    from cps_agents.files import write_json
    from cps_agents.machine import available_cores
    from cps_agents.progress import Progress
    from cps_baselines.rogue.probing_search import RATIOS, ProbingSearch, search_answers
    from cps_baselines.rogue.switching_search import DEFENDERS
    from cps_baselines.workers import Workers

    ratios = sorted(ratio or RATIOS)
    count = 2 * len(ratios) * len(DEFENDERS)
    with Progress("searches", count) as progress, Workers(min(jobs or available_cores(), count)) as pool:

        def report(done: int, note: str, found: dict[str, Any]) -> None:
            progress.update(done, note)
            if to is not None and found["found"]:
                write_json(to, found)

        found = search_answers(ratios, ProbingSearch(seed=seed), pool, report)
    if to is None:
        print_json(found)
        return
    write_json(to, found)
    err().print(f"{count} searches: {to}", soft_wrap=True)
