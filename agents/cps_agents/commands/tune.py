"""`cps-envs tune`: search the knobs of a recipe with Optuna."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.options import AsJson, Changes
from cps_agents.console import assignments, err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.machine import available_cores
from cps_agents.table import Table

if TYPE_CHECKING:
    from cps_agents.learning.study import Tried

RANGE = "Search this knob: LOW:HIGH, LOW:HIGH:log or A|B|C. May be repeated; default: what usually matters."


def tune(
    name: Annotated[str, typer.Argument(metavar="RECIPE", help="Recipe or environment id, as for `train`.")],
    trials: Annotated[int, typer.Option(min=1, help="Trials in all; ask for more to continue a study.")] = 20,
    ranges: Annotated[list[str] | None, typer.Option("--range", metavar="KNOB=RANGE", help=RANGE)] = None,
    overrides: Changes = None,
    knobs: Annotated[
        list[str] | None,
        typer.Option("--knob", metavar="NAME=VALUE", help="Set a knob for all trials; may be repeated."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Train for so many decisions per run; default: the recipe's.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Training seeds of each trial; their mean counts.")] = 1,
    sampler_seed: Annotated[int, typer.Option(min=0, help="Seed of Optuna's sampler (TPE).")] = 0,
    folder: Annotated[Path, typer.Option("--out", help="Write the study and its runs to this folder.")] = Path("tune"),
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Run so many trials at a time; default: as many as cores.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Search better knobs for a recipe; each trial trains with other values.

    Validation seeds judge a trial. Press Ctrl-C at any time: finished trials are kept, and the same command continues.
    The result is a choice and not a figure to publish. Train the winner on five seeds and judge it with `cps-envs
    evaluate`.
    """
    from cps_agents.learning.recipe import changed
    from cps_agents.learning.study import Study, usual_ranges
    from cps_agents.recipes.finding import find_recipe
    from cps_envs.core.errors import require

    require("optuna", extra="tune", purpose="tuning")
    require("stable_baselines3", extra="train", purpose="tuning")
    given = dict(assignments(knobs or [], "--knob", "learning_rate=0.001"))
    if steps is not None:
        given["total_steps"] = steps
    if overrides:
        given["overrides"] = dict(assignments(overrides))
    recipe = changed(find_recipe(name), given)
    searched = dict(_split(text) for text in ranges) if ranges else usual_ranges(recipe)
    study = Study(recipe, searched, seeds, folder / recipe.name, sampler_seed)
    tried = study.run(trials, jobs or available_cores())
    if as_json:
        print_json([row._asdict() for row in tried])
        return
    _show(name, tried, list(searched), given)
    err().print(f"Kept: {study.path}. More trials go on with it.", soft_wrap=True)


def _split(text: str) -> tuple[str, str]:
    knob, equals, values = text.partition("=")
    if not (knob and equals and values):
        raise CommandError(f"--range {text!r}: write KNOB=LOW:HIGH, KNOB=LOW:HIGH:log or KNOB=A|B|C")
    return knob.strip(), values.strip()


def _show(name: str, tried: list[Tried], knobs: list[str], fixed: Mapping[str, Any]) -> None:
    best_first = sorted(tried, key=lambda row: -row.score)
    rows = [(str(row.number), f"{row.score:.4g}", *(_short(row.values[knob]) for knob in knobs)) for row in best_first]
    console = out()
    console.print(Table("Trials, the best first", ("trial", "validation", *knobs), rows))
    values = {**fixed, **best_first[0].values}
    chosen = " ".join(f"--knob {shlex.quote(f'{knob}={_short(value)}')}" for knob, value in values.items())
    console.print(f"Train it: cps-envs train {name} {chosen}", markup=False, soft_wrap=True)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value).replace(" ", "").replace("'", '"')
