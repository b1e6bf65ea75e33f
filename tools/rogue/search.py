"""`python -m tools.rogue.search`: the searches behind what the rogue attackers `switching` and `probe` play."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.commands.options import Jobs
from cps_agents.console import note, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.machine import available_cores
from cps_agents.progress import Progress
from cps_baselines.rogue.switching import shipped_weights
from cps_baselines.workers import Workers
from cps_paper.rogue.worlds import ALL, RATIOS
from tools.command import run
from tools.rogue.probing import AGAIN, ProbingSearch, search_answers
from tools.rogue.probing import RATIOS as PROBED
from tools.rogue.switching import DEFENDERS, SwitchingSearch
from tools.rogue.switching import search_switching as search_weights

File = Annotated[Path | None, typer.Option("--out", help="Write to this file; default: stdout.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the search.")]
PROBE = "Search what `probe` plays instead (20 CPU minutes). Takes --ratio, --seed, --jobs and --out."
AGAINST = "Defender, or all: the mean over those of chapter 5. May be repeated; default: everything."


@contextmanager
def _keeping(what: str, count: int, to: Path | None) -> Iterator[Callable[[int, str, dict[str, Any]], None]]:
    """A progress bar over so many pieces; each report goes to the file, too."""
    with Progress(what, count) as progress:

        def report(done: int, note: str, found: dict[str, Any]) -> None:
            progress.update(done, note)
            if to is not None and found.get("found", True):  # not before there is something
                write_json(to, found)

        yield report


def search_switching(
    against: Annotated[list[str] | None, typer.Option(help=AGAINST)] = None,
    ratio: Annotated[list[float] | None, typer.Option(help="Power ratio; may be repeated. Default: 1 and 1.3.")] = None,
    generations: Annotated[int, typer.Option(min=1, help="Generations of each restart.")] = 30,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 24,
    restarts: Annotated[int, typer.Option(min=1, help="Run so often independently; the best counts.")] = 2,
    seed: Seed = 0,
    jobs: Jobs = None,
    to: File = None,
    probe: Annotated[bool, typer.Option("--probe", help=PROBE)] = False,
    again: Annotated[bool, typer.Option("--again", help="With --probe: search longer, from the package's.")] = False,
) -> None:
    """Find the weights of the rogue attacker `switching` against each defender; the result is JSON.

    A run against one defender starts from what was found against all, or else from the weights of the package. After
    every search the file holds what has been found so far, so an interrupted run is not lost.
    """
    if probe:
        _search_answers(ratio, seed, jobs, to, again=again)
        return
    names, ratios = against or (ALL, *DEFENDERS), ratio or RATIOS
    starts = {known: tuple(weights.tolist()) for known, weights in shipped_weights().items()}
    found: dict[tuple[str, float], dict[str, Any]] = {}
    count = len(names) * len(ratios)
    with _keeping("searches", count, to) as keep, Workers(min(jobs or available_cores(), count)) as pool:
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
            for search, result in pool.run(search_weights, searches):
                found[search.against, search.power_ratio] = result
                starts[search.against, search.power_ratio] = tuple(result["weights"])
                line = f"{search.label}: {result['verified']:.1f} m/s"
                keep(len(found), line, document(found, names, ratios))
    _deliver(document(found, names, ratios), to, f"{count} searches")


def document(
    found: Mapping[tuple[str, float], dict[str, Any]], names: Sequence[str], ratios: Sequence[float]
) -> dict[str, Any]:
    """What has been found so far, in the order of the request."""
    return {"found": [found[name, ratio] for name in names for ratio in ratios if (name, ratio) in found]}


def _search_answers(ratio: list[float] | None, seed: int, jobs: int | None, to: Path | None, *, again: bool) -> None:
    ratios = sorted(ratio or PROBED)
    if again and (unknown := set(ratios) - set(PROBED)):
        raise CommandError(f"the package has no answers at the power ratio {min(unknown):g}: leave out --again")
    search = replace(AGAIN if again else ProbingSearch(), seed=seed)
    count = 2 * len(ratios) * len(DEFENDERS)
    with _keeping("searches", count, to) as keep, Workers(min(jobs or available_cores(), count)) as pool:
        found = search_answers(ratios, search, pool, keep, again=again)
    _deliver(found, to, f"{count} searches")


def _deliver(result: Any, to: Path | None, said: str) -> None:
    """Write a result as JSON and say so, or print it where no file is named."""
    if to is None:
        print_json(result)
        return
    write_json(to, result)
    note(f"{said}: {to}")


if __name__ == "__main__":
    run(search_switching, "python -m tools.rogue.search")
