"""`cps-envs search-feedback`: the search behind the coefficients of the disbanding defender `feedback`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.console import err, print_json


def search_feedback(
    trials: Annotated[int, typer.Option(min=1, help="Candidate policies.")] = 600,
    population: Annotated[int, typer.Option(min=4, help="Candidates per generation.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Of the search.")] = 0,
    to: Annotated[Path | None, typer.Option("--out", help="File to write; stdout if left out.")] = None,
) -> None:
    """Search the coefficients of the disbanding defender `feedback`; the result is JSON."""
    from agents.files import write_json
    from agents.progress import Progress
    from baselines.disbanding.feedback_search import FeedbackSearch, search_feedback

    search = FeedbackSearch(trials=trials, population=population, seed=seed)
    with Progress("trials", trials) as progress:
        result = search_feedback(search, lambda done, cost: progress.update(done, f"best cost {cost:.3f}"))
    if to is None:
        print_json(result)
        return
    write_json(to, result)
    err().print(f"cost {result['cost']:.3f} after {trials} trials: {to}", soft_wrap=True)
