"""`cps-envs train`: learn a policy with stable-baselines3, or by policy search."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.options import AsJson, Jobs, Knobs, OfEnvironment
from cps_agents.console import assignments, err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.table import Table

if TYPE_CHECKING:
    from cps_agents.learning.job import Job
    from cps_agents.learning.recipe import Recipe

NAME = "An environment id such as HvacAttack-v0, a recipe from `cps-envs train --list`, or all recipes: all."
SHIP = "Put the best networks of the seeds into this folder as one policy, as `cps-envs zoo add` does."
ALGORITHM = "ppo, maskable-ppo, recurrent-ppo, recurrent-imitation, sac, dqn or cma-es."
CONFIG = "The run.json of an earlier run, to repeat it exactly; other options still change what they name."
TRACKER = "Where curves go: tensorboard, wandb, mlflow or none."
EXPLANATION = """Train one with `cps-envs train RECIPE`. CPU minutes are those of one training seed.
Validation is what the attacker is paid, for a defender with a minus: the mean
over the shipped seeds, on the episodes that chose among their networks.
docs/results.md judges on others. `--json` shows opponents and every knob."""
OPPONENT = "A policy's name, mixture?policies=[...], zoo:NAME; the recipe's own if left out."


def train(
    name: Annotated[str | None, typer.Argument(metavar="ID", help=NAME)] = None,
    config: Annotated[Path | None, typer.Option(metavar="RUN.json", help=CONFIG)] = None,
    algorithm: Annotated[str | None, typer.Option("--algo", help=ALGORITHM)] = None,
    opponent: Annotated[str | None, typer.Option(help=OPPONENT)] = None,
    preset: Annotated[str | None, typer.Option(help="Of the environment; the recipe's own if left out.")] = None,
    overrides: OfEnvironment = None,
    knobs: Knobs = None,
    policy: Annotated[str | None, typer.Option("--name", help="Of the policy; the recipe's own if left out.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="How many training seeds; 5 if left out.")] = None,
    first_seed: Annotated[int | None, typer.Option(min=0, help="The first of them; 0 if left out.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Decisions per seed, episodes with cma-es.")] = None,
    folder: Annotated[Path, typer.Option("--out", help="Where runs go, in a folder for each seed.")] = Path("runs"),
    ship: Annotated[Path | None, typer.Option("--to", help=SHIP)] = None,
    jobs: Jobs = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with unfinished runs.")] = False,
    device: Annotated[str, typer.Option(help="cpu, cuda or auto. Networks this small are fastest on a CPU.")] = "cpu",
    tracker: Annotated[str, typer.Option(help=TRACKER)] = "tensorboard",
    show: Annotated[bool, typer.Option("--list", help="Print the recipes and stop.")] = False,
    as_json: AsJson = False,
) -> None:
    """Train a policy by its recipe, one run for each seed.

    Without ID: what there is to train, what it costs and what it reaches. Each run's folder holds its configuration,
    versions and command, evaluations on validation seeds, curves, a checkpoint, and the best policy so far, which plays
    everywhere as zoo:FOLDER. Ctrl-C leaves a usable policy; --resume goes on. With cma-es the numbers of a family of
    policies are searched, and a step is an episode.
    """
    from cps_agents.learning.earlier import read_earlier
    from cps_agents.learning.recipe import changed
    from cps_agents.learning.tracking import check_tracker
    from cps_agents.machine import available_cores
    from cps_agents.recipes.finding import RECIPES, find_recipe

    earlier = None if config is None else read_earlier(config)
    if show or (name is None and earlier is None):
        _list(list(RECIPES.values()), as_json)
        return
    if name is not None and earlier is not None:
        raise CommandError(f"--config says what is trained, so leave out {name!r}")
    check_tracker(tracker)
    given = {"algorithm": algorithm, "opponent": opponent, "preset": preset, "name": policy, "total_steps": steps}
    values: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    values |= assignments(knobs or [], "--knob", "learning_rate=0.001")
    if overrides:
        values["overrides"] = dict(assignments(overrides))
    first = first_seed if first_seed is not None else 0 if earlier is None else earlier.seed
    wanted = range(first, first + (seeds or (5 if earlier is None else 1)))
    chosen = [earlier.recipe] if earlier else list(RECIPES.values()) if name == "all" else [find_recipe(name or "")]
    found = []
    for recipe in chosen:
        runs = _jobs(changed(recipe, values), wanted, folder, resume=resume, device=device, tracker=tracker)
        found.append(_train(runs, jobs or available_cores(), ship))
        if not as_json:
            _print(runs, found[-1])
    if as_json:
        print_json(found[0] if len(found) == 1 else found)


def _jobs(recipe: Recipe, seeds: range, folder: Path, **how: Any) -> list[Job]:
    from cps_agents.learning.job import Job
    from cps_agents.learning.recipe import SEARCH
    from cps_agents.machine import describe
    from cps_envs.core.errors import require

    if recipe.algorithm != SEARCH:
        require("stable_baselines3", extra="train", purpose="training")

    command = describe()["command"]
    home = folder / recipe.name
    return [Job(recipe, seed, home / f"seed-{seed}", command, **how) for seed in seeds]


def _train(runs: list[Job], workers: int, ship: Path | None) -> dict[str, Any]:
    """What came out; the policies are shipped if asked for."""
    from cps_agents.learning.runs import train_all
    from cps_agents.zoo.merging import merge

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
    out().print(Table(found["recipe"], ("seed", "steps", "CPU s", "best validation", "zoo:"), rows))
    err().print(f"Play one with --{runs[0].recipe.role} zoo:{runs[0].folder}", soft_wrap=True)


def _list(recipes: list[Recipe], as_json: bool) -> None:
    from dataclasses import asdict

    if as_json:
        print_json([asdict(recipe) for recipe in recipes])
        return
    columns = ("recipe", "algorithm", "CPU min", "validation")
    out().print(Table("Recipes", columns, [_row(recipe) for recipe in recipes], left=2))
    out().print(EXPLANATION, markup=False, soft_wrap=True)


def _row(recipe: Recipe) -> tuple[str, ...]:
    """What a recipe costs and reaches, by the policy that comes with the package."""
    from cps_agents.zoo.card import SHIPPED, read_card

    path = SHIPPED / f"{recipe.name}.json"
    start = (recipe.name, recipe.algorithm)
    if not path.is_file():
        return (*start, "", "not shipped")
    seeds = list(read_card(path).seeds.values())
    cpu_min, score = (sum(facts[key] for facts in seeds) / len(seeds) for key in ("cpu_s", "validation"))
    return (*start, f"{cpu_min / 60:.1f}", f"{score:.4g}")
