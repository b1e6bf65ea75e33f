"""`cps-envs search-feedback`: the search behind the coefficients of the disbanding defender `feedback`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import err, print_json


def search_feedback(
    trials: Annotated[int, typer.Option(min=1, help="Try so many candidates.")] = 600,
    population: Annotated[int, typer.Option(min=4, help="Candidates in each generation.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    to: Annotated[Path | None, typer.Option("--out", help="Write to this file; default: stdout.")] = None,
) -> None:
    """Find the coefficients of the disbanding defender `feedback`; the result is JSON.

    The file holds the best coefficients so far after every generation, so an interrupted search is not lost.
    """
    from cps_agents.files import write_json
    from cps_agents.progress import Progress
    from cps_baselines.disbanding.feedback_search import FeedbackSearch, search_feedback

    search = FeedbackSearch(trials=trials, population=population, seed=seed)
    with Progress("trials", trials) as progress:

        def report(done: int, found: dict[str, Any]) -> None:
            progress.update(done, f"best cost {found['cost']:.3f}")
            if to is not None:
                write_json(to, found)

        result = search_feedback(search, report)
    if to is None:
        print_json(result)
        return
    write_json(to, result)
    err().print(f"cost {result['cost']:.3f} after {trials} trials: {to}", soft_wrap=True)
