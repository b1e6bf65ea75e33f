"""`cps-envs train`: learn a policy with stable-baselines3."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from agents.console import assignments, err, json_value, make_table, out, print_json

NAME = "An environment id such as HvacAttack-v0, or a recipe from `cps-envs train --list`."
OPPONENT = "A policy's name, mixture?policies=[...], zoo:NAME; the recipe's own if left out."


def train(
    name: Annotated[str | None, typer.Argument(metavar="ID", help=NAME)] = None,
    algorithm: Annotated[
        str | None, typer.Option("--algo", help="ppo, maskable-ppo, recurrent-ppo, sac or dqn.")
    ] = None,
    opponent: Annotated[str | None, typer.Option(help=OPPONENT)] = None,
    preset: Annotated[str | None, typer.Option(help="Of the environment; the recipe's own if left out.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Of the environment; may be repeated.")
    ] = None,
    knobs: Annotated[
        list[str] | None, typer.Option("--knob", metavar="NAME=VALUE", help="Of the recipe; may be repeated.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many training seeds.")] = 5,
    first_seed: Annotated[int, typer.Option(min=0, help="The first of them.")] = 0,
    steps: Annotated[int | None, typer.Option(min=1, help="Decisions per seed; the recipe's own if left out.")] = None,
    folder: Annotated[Path, typer.Option("--out", help="Where runs go, in a folder for each seed.")] = Path("runs"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with unfinished runs.")] = False,
    device: Annotated[str, typer.Option(help="cpu, cuda or auto. Networks this small are fastest on a CPU.")] = "cpu",
    show: Annotated[bool, typer.Option("--list", help="Print the recipes and stop.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Train policies by a recipe, one run for each seed.

    Each run's folder holds its configuration, versions and command, evaluations on validation seeds, TensorBoard logs,
    a checkpoint, and the best policy so far, which plays everywhere as zoo:FOLDER. Ctrl-C leaves a usable policy;
    --resume goes on.
    """
    from agents.machine import available_cores
    from agents.recipes.finding import RECIPES, find_recipe

    if show or name is None:
        _list(list(RECIPES.values()), as_json)
        return
    values = {
        key: value for key, value in (("algorithm", algorithm), ("opponent", opponent), ("preset", preset)) if value
    }
    recipe = _recipe(find_recipe(name), values, assignments(overrides or []), _knobs(knobs or []), steps)
    _train(recipe, range(first_seed, first_seed + seeds), folder, jobs or available_cores(), resume, device, as_json)


def _knobs(pairs: list[str]) -> dict[str, Any]:
    values = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not (name and equals):
            raise ValueError(f"--knob {pair!r}: write it as name=value, for example --knob learning_rate=0.001")
        values[name.strip()] = json_value(text.strip())
    return values


def _recipe(recipe: Any, values: dict[str, Any], overrides: Any, knobs: dict[str, Any], steps: int | None) -> Any:
    from agents.learning.recipe import changed

    if overrides:
        values["overrides"] = dict(overrides)
    if steps is not None:
        values["total_steps"] = steps
    return changed(recipe, {**values, **knobs})


def _train(recipe: Any, seeds: range, folder: Path, workers: int, resume: bool, device: str, as_json: bool) -> None:
    from agents.machine import describe
    from cps_envs.core.errors import require

    require("stable_baselines3", extra="agents", purpose="training")
    from agents.learning.runs import train_all
    from agents.learning.training import Job

    command = describe()["command"]
    runs = [
        Job(recipe, seed, folder / recipe.name / f"seed-{seed}", command, resume=resume, device=device)
        for seed in seeds
    ]
    results = train_all(runs, workers, recipe.name)
    if as_json:
        print_json(
            {
                "recipe": recipe.name,
                "runs": [{"folder": str(job.folder), **found} for job, found in zip(runs, results, strict=True)],
            }
        )
        return
    rows = [
        (str(job.seed), f"{found['steps']:,}", f"{found['cpu_s']:.0f}", f"{found['best_score']:.4g}", str(job.folder))
        for job, found in zip(runs, results, strict=True)
    ]
    out().print(make_table(recipe.name, ("seed", "steps", "CPU s", "best validation", "zoo:"), rows))
    err().print(f"Play one with --{recipe.role} zoo:{runs[0].folder}", soft_wrap=True)


def _list(recipes: list[Any], as_json: bool) -> None:
    from dataclasses import asdict

    from cps_envs.registration import PROBLEMS

    if as_json:
        print_json([asdict(recipe) for recipe in recipes])
        return
    rows = [
        (
            recipe.name,
            PROBLEMS[recipe.problem].env_id(recipe.role).removeprefix("cps_envs/"),
            recipe.algorithm,
            recipe.opponent or "the preset's",
            f"{recipe.total_steps:,}",
        )
        for recipe in recipes
    ]
    out().print(make_table("Recipes", ("name", "environment", "algorithm", "opponent", "steps"), rows, left=4))
