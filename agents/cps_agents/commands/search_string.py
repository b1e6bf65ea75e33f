"""`cps-envs search-string`: the search behind the numbers of the disbanding defenders `string`, `local`, `informed`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import assignments, err, print_json


def search_string(
    form: Annotated[str, typer.Option(help="Form of the controller: warned, local or informed.")] = "warned",
    trials: Annotated[int, typer.Option(min=1, help="Try so many candidates.")] = 1400,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 14,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    spread: Annotated[float, typer.Option(help="Begin with this deviation, in units of the search.")] = 0.4,
    start: Annotated[Path | None, typer.Option(help="Start from the result in this file.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
    ] = None,
    to: Annotated[Path | None, typer.Option("--out", help="Write to this file; default: stdout.")] = None,
) -> None:
    """Find the numbers of the disbanding defender `string`; the result is JSON.

    The file holds the result so far after every generation, so an interrupted search is not lost.
    """
    from cps_agents.files import write_json
    from cps_agents.progress import Progress
    from cps_baselines.disbanding.string_search import StringSearch, found_before, search_string
    from cps_envs.core.documents import read_entry

    overrides = assignments(settings or [])
    search = StringSearch(form, trials=trials, population=population, seed=seed, spread=spread, overrides=overrides)
    kind, remedy = "result of `cps-envs search-string`", "Name another one, or leave out --start."
    begun = None if start is None else found_before(read_entry(start, kind, remedy))
    with Progress("trials", trials) as progress:

        def report(done: int, found: dict[str, Any]) -> None:
            progress.update(done, f"cost {found['cost']:.3f}")
            if to is not None:
                write_json(to, found)

        result = search_string(search, report, begun)
    if to is None:
        print_json(result)
        return
    write_json(to, result)
    err().print(f"cost {result['cost']:.3f} after {trials} trials: {to}", soft_wrap=True)
