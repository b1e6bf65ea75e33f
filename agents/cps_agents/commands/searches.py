"""The searches behind the numbers of shipped analytic policies: `search-string`, `search-feedback`, `search-switching`.

Each file holds the result so far while the search goes on, so an interrupted one is not lost. `calibrate-mtd2` finds
the threshold eps of the HVAC defender `mtd2` from attack-free days.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.options import AsJson, Changes, Jobs, deliver
from cps_agents.console import assignments, err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.machine import available_cores
from cps_agents.progress import Progress
from cps_agents.table import Table
from cps_baselines.workers import Workers

if TYPE_CHECKING:
    from cps_baselines.hvac.calibrated import Calibration, Level

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


def search_string(
    form: Annotated[str, typer.Option(help="Form of the controller: warned, local or informed.")] = "warned",
    trials: Annotated[int, typer.Option(min=1, help="Try so many candidates.")] = 1400,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 14,
    seed: Seed = 0,
    spread: Annotated[float, typer.Option(help="Begin with this deviation, in units of the search.")] = 0.4,
    start: Annotated[Path | None, typer.Option(help="Start from the result in this file.")] = None,
    settings: Changes = None,
    to: File = None,
) -> None:
    """Find the numbers of the disbanding defender `string`; the result is JSON.

    The file holds the result so far after every generation, so an interrupted search is not lost.
    """
    from cps_baselines.disbanding.string_search import StringSearch, found_before, search_string
    from cps_envs.core.documents import read_entry

    overrides = assignments(settings or [])
    search = StringSearch(form, trials=trials, population=population, seed=seed, spread=spread, overrides=overrides)
    kind, remedy = "result of `cps-envs search-string`", "Name another one, or leave out --start."
    begun = None if start is None else found_before(read_entry(start, kind, remedy))
    with _keeping("trials", trials, to) as keep:
        found = search_string(search, lambda done, best: keep(done, f"cost {best['cost']:.3f}", best), begun)
    deliver(found, to, f"cost {found['cost']:.3f} after {trials} trials")


def search_feedback(
    trials: Annotated[int, typer.Option(min=1, help="Try so many candidates.")] = 600,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 20,
    seed: Seed = 0,
    to: File = None,
) -> None:
    """Find the coefficients of the disbanding defender `feedback`; the result is JSON.

    The file holds the best coefficients so far after every generation, so an interrupted search is not lost.
    """
    from cps_baselines.disbanding.feedback_search import FeedbackSearch, search_feedback

    search = FeedbackSearch(trials=trials, population=population, seed=seed)
    with _keeping("trials", trials, to) as keep:
        found = search_feedback(search, lambda done, best: keep(done, f"best cost {best['cost']:.3f}", best))
    deliver(found, to, f"cost {found['cost']:.3f} after {trials} trials")


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
    from cps_baselines.rogue.switching import shipped_weights
    from cps_baselines.rogue.switching_search import ALL, DEFENDERS, RATIOS, SwitchingSearch, search_switching

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
            for search, result in pool.run(search_switching, searches):
                found[search.against, search.power_ratio] = result
                starts[search.against, search.power_ratio] = tuple(result["weights"])
                note = f"{search.label}: {result['verified']:.1f} m/s"
                keep(len(found), note, document(found, names, ratios))
    deliver(document(found, names, ratios), to, f"{count} searches")


def document(
    found: Mapping[tuple[str, float], dict[str, Any]], names: Sequence[str], ratios: Sequence[float]
) -> dict[str, Any]:
    """What has been found so far, in the order of the request."""
    return {"found": [found[name, ratio] for name in names for ratio in ratios if (name, ratio) in found]}


def _search_answers(ratio: list[float] | None, seed: int, jobs: int | None, to: Path | None, *, again: bool) -> None:
    from cps_baselines.rogue.probing_search import AGAIN, RATIOS, ProbingSearch, search_answers
    from cps_baselines.rogue.switching_search import DEFENDERS

    ratios = sorted(ratio or RATIOS)
    if again and (unknown := set(ratios) - set(RATIOS)):
        raise CommandError(f"the package has no answers at the power ratio {min(unknown):g}: leave out --again")
    search = replace(AGAIN if again else ProbingSearch(), seed=seed)
    count = 2 * len(ratios) * len(DEFENDERS)
    with _keeping("searches", count, to) as keep, Workers(min(jobs or available_cores(), count)) as pool:
        found = search_answers(ratios, search, pool, keep, again=again)
    deliver(found, to, f"{count} searches")


DIGITS = 6


def calibrate_mtd2(
    preset: Annotated[str, typer.Option(help="Start from this preset.")] = "paper",
    overrides: Changes = None,
    num_seeds: Annotated[int, typer.Option("--seeds", min=1, help="Play so many days, on seeds 1000, 1001, ...")] = 5,
    to: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.json", help="Also write the JSON to this file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the threshold eps of the HVAC defender `mtd2` from days without an attack.

    eps is 1.2 times the largest mean residual of any set, from 20 samples on. Without --preset and --set the command
    computes it for the configurations whose eps comes with the package.
    """
    from cps_baselines.hvac.calibrated import SEEDS, SHIPPED, Level

    seeds = range(SEEDS[0], SEEDS[0] + num_seeds)
    own = preset != "paper" or overrides
    levels = (Level(preset, assignments(overrides or [])),) if own else SHIPPED
    found = _calibrate(levels, seeds)
    document = _document(found, seeds)
    if to is not None:
        write_json(to, document)
    if as_json:
        print_json(document)
    else:
        _print(found, seeds)
    if to is not None:
        err().print(f"Written: {to}", soft_wrap=True)


def _calibrate(levels: tuple[Level, ...], seeds: range) -> list[tuple[Level, Calibration]]:
    from cps_baselines.hvac.calibrated import calibrate

    total, done = sum(level.config.num_steps for level in levels), 0
    found = []
    with Progress("steps", total) as progress:
        for level in levels:

            def report(step: int, done: int = done) -> None:
                progress.update(done + step)

            found.append((level, calibrate(level.config, seeds, report=report)))
            done += level.config.num_steps
    return found


def _document(found: list[tuple[Level, Calibration]], seeds: range) -> dict[str, Any]:
    from cps_baselines.hvac.calibrated import DEFENDER, MARGIN, SETTLING_STEPS

    return {
        "margin": MARGIN,
        "settling_steps": SETTLING_STEPS,
        "defender": DEFENDER,
        "seeds": list(seeds),
        "levels": [
            {
                "preset": level.preset,
                "overrides": dict(level.overrides),
                "threshold_c2": round(calibration.threshold_c2, DIGITS),
                "configured_c2": level.config.threshold_c2,
                "largest_set": list(calibration.largest_set),
                "rejecting_share": calibration.rejecting_share.round(DIGITS),
            }
            for level, calibration in found
        ],
    }


def _print(found: list[tuple[Level, Calibration]], seeds: range) -> None:
    columns = ("configuration", "eps, C2", "decided by", "eps now", "rejects all")
    rows = [
        (
            _name(level),
            f"{calibration.threshold_c2:.3f}",
            ", ".join(f"s{sensor}" for sensor in calibration.largest_set),
            f"{level.config.threshold_c2:g}",
            f"{calibration.rejecting_share.mean():.1%}",
        )
        for level, calibration in found
    ]
    title = f"eps of MTD2 from {len(seeds)} attack-free days, seeds {seeds[0]} to {seeds[-1]}"
    console = out()
    console.print(Table(title, columns, rows))
    console.print(
        "rejects all: steps with a full window in which no set passes the eps that the configuration has now."
    )


def _name(level: Level) -> str:
    return ", ".join(
        [
            level.preset,
            *(
                f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
                for name, value in level.overrides.items()
            ),
        ]
    )
