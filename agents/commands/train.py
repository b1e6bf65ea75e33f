"""`cps-envs train`: learn a policy with stable-baselines3."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.console import assignments, err, make_table, out, print_json

if TYPE_CHECKING:
    from agents.learning.recipe import Recipe
    from agents.learning.training import Job

NAME = "An environment id such as HvacAttack-v0, a recipe from `cps-envs train --list`, or all recipes: all."
SHIP = "Put the best networks of the seeds into this folder as one policy, as `cps-envs zoo add` does."
OPPONENT = "A policy's name, mixture?policies=[...], zoo:NAME; the recipe's own if left out."


def train(
    name: Annotated[str | None, typer.Argument(metavar="ID", help=NAME)] = None,
    algorithm: Annotated[
        str | None, typer.Option("--algo", help="ppo, maskable-ppo, recurrent-ppo, recurrent-imitation, sac or dqn.")
    ] = None,
    opponent: Annotated[str | None, typer.Option(help=OPPONENT)] = None,
    preset: Annotated[str | None, typer.Option(help="Of the environment; the recipe's own if left out.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Of the environment; may be repeated.")
    ] = None,
    knobs: Annotated[
        list[str] | None, typer.Option("--knob", metavar="NAME=VALUE", help="Of the recipe; may be repeated.")
    ] = None,
    policy: Annotated[str | None, typer.Option("--name", help="Of the policy; the recipe's own if left out.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many training seeds.")] = 5,
    first_seed: Annotated[int, typer.Option(min=0, help="The first of them.")] = 0,
    steps: Annotated[int | None, typer.Option(min=1, help="Decisions per seed; the recipe's own if left out.")] = None,
    folder: Annotated[Path, typer.Option("--out", help="Where runs go, in a folder for each seed.")] = Path("runs"),
    ship: Annotated[Path | None, typer.Option("--to", help=SHIP)] = None,
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
    given = {"algorithm": algorithm, "opponent": opponent, "preset": preset, "name": policy, "total_steps": steps}
    values: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    values |= assignments(knobs or [], "--knob", "learning_rate=0.001")
    if overrides:
        values["overrides"] = dict(assignments(overrides))
    chosen = list(RECIPES.values()) if name == "all" else [find_recipe(name)]
    found = []
    for recipe in chosen:
        runs = _jobs(_changed(recipe, values), range(first_seed, first_seed + seeds), folder, resume, device)
        found.append(_train(runs, jobs or available_cores(), ship))
        if not as_json:
            _print(runs, found[-1])
    if as_json:
        print_json(found[0] if len(found) == 1 else found)


def _changed(recipe: Recipe, values: dict[str, Any]) -> Recipe:
    from agents.learning.recipe import changed

    return changed(recipe, values)


def _jobs(recipe: Recipe, seeds: range, folder: Path, resume: bool, device: str) -> list[Job]:
    from agents.machine import describe
    from cps_envs.core.errors import require

    require("stable_baselines3", extra="agents", purpose="training")
    from agents.learning.training import Job

    command = describe()["command"]
    home = folder / recipe.name
    return [Job(recipe, seed, home / f"seed-{seed}", command, resume=resume, device=device) for seed in seeds]


def _train(runs: list[Job], workers: int, ship: Path | None) -> dict[str, Any]:
    """What came out; the policies are shipped if asked for."""
    from agents.learning.runs import train_all
    from agents.zoo.merging import merge

    name = runs[0].recipe.name
    results = train_all(runs, workers, name)
    if ship is not None:
        merge([job.run.card for job in runs], ship / f"{name}.json")
        err().print(f"Written: {ship / name}.json and {name}.safetensors", soft_wrap=True)
    return {
        "recipe": name,
        "runs": [{"folder": str(job.folder), **found} for job, found in zip(runs, results, strict=True)],
    }


def _print(runs: list[Job], found: dict[str, Any]) -> None:
    rows = [
        (str(run["seed"]), f"{run['steps']:,}", f"{run['cpu_s']:.0f}", f"{run['best_score']:.4g}", run["folder"])
        for run in found["runs"]
    ]
    out().print(make_table(found["recipe"], ("seed", "steps", "CPU s", "best validation", "zoo:"), rows))
    err().print(f"Play one with --{runs[0].recipe.role} zoo:{runs[0].folder}", soft_wrap=True)


def _list(recipes: list[Recipe], as_json: bool) -> None:
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
