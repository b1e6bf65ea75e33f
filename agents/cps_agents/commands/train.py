"""`cps-envs train`: learn a policy by its recipe."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.commands.options import AsJson, AtCluster, Changes, Jobs, Knobs, OfPart, described, whole, workers
from cps_agents.console import assignments, note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.learning.learner import train_all
from cps_agents.learning.recipe import SEARCH, SHARED, Recipe, changed, knobs_of
from cps_agents.learning.run import FINISHED, TrainingJob, read_earlier
from cps_agents.learning.tracking import check_tracker
from cps_agents.machine import describe
from cps_agents.part import Part, Unfinished
from cps_agents.recipes.finding import RECIPES, find_recipe
from cps_agents.sheet import Sheet
from cps_agents.workers import Where
from cps_agents.zoo.card import SHIPPED, read_card
from cps_envs import find_problem
from cps_envs.core.errors import require
from cps_envs.core.game.problem import Later
from cps_envs.core.types import Role, other

NAME = "Environment id such as HvacAttack-v0, recipe of `train --list`, MODULE:CLASS, or all."
SHIP = "Combine the seeds' best networks into one policy in this folder."
ALGORITHM = "Algorithm: shared-ppo, our own PPO, or cma-es, a search for the numbers of a family."
CONFIG = "Repeat the run of this run.json, but for other options; or train in the system of this FILE.toml."
TRACKER = "Send curves to tensorboard or none."
EXPLANATION = (
    "Train one with `cps-envs train RECIPE`. CPU minutes are those of one training seed. Validation is the "
    "return of the role: the mean over the shipped seeds, on the episodes that chose among their networks, so do not "
    "cite it. `--json` shows opponents and every knob."
)
merge = Later("cps_agents.zoo.merging:merge")  # loads compiled kernels, which --list need not wait for
OPPONENT = "Train against this {}: a name, mixture?policies=[...] or zoo:NAME. Default: the recipe's."


def train(
    name: Annotated[str | None, typer.Argument(metavar="ID", help=NAME)] = None,
    config: Annotated[Path | None, typer.Option(metavar="FILE", help=CONFIG)] = None,
    algorithm: Annotated[str | None, typer.Option("--algo", help=ALGORITHM)] = None,
    attacker: Annotated[str | None, typer.Option(help=OPPONENT.format("attacker"))] = None,
    defender: Annotated[str | None, typer.Option(help=OPPONENT.format("defender"))] = None,
    preset: Annotated[str | None, typer.Option(help="Preset of the environment; default: the recipe's.")] = None,
    overrides: Changes = None,
    knobs: Knobs = None,
    policy: Annotated[str | None, typer.Option("--name", help="Name the policy; default: the recipe's name.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Use so many training seeds; default: 5.")] = None,
    first_seed: Annotated[int | None, typer.Option(min=0, help="First training seed; default: 0.")] = None,
    steps: Annotated[
        int | None,
        typer.Option(parser=whole, metavar="N", help="Train for so many decisions per seed; with cma-es: episodes."),
    ] = None,
    folder: Annotated[
        Path, typer.Option("--out", help="Write runs to this folder, one subfolder for each seed.")
    ] = Path("runs"),
    ship: Annotated[Path | None, typer.Option("--to", help=SHIP)] = None,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    part: OfPart = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue unfinished runs.")] = False,
    tracker: Annotated[str, typer.Option(help=TRACKER)] = "tensorboard",
    show: Annotated[bool, typer.Option("--list", help="Print the recipes and stop.")] = False,
    as_json: AsJson = False,
) -> None:
    """Train a policy by its recipe, one run for each seed.

    Without ID it lists what you can train, what that costs and what it reaches. Each run has a folder with its
    configuration, versions, command, curves, evaluations on validation seeds, a checkpoint and the best policy so far.
    That policy plays everywhere as zoo:FOLDER.

    Press Ctrl-C at any time: the policy so far is usable, and --resume continues. cma-es searches the numbers of a
    family of policies; there a step is an episode. What it finds plays as the policy that is printed at the end.
    """
    file = config if config is not None and config.suffix.lower() == ".toml" else None
    earlier = None if config is None or file is not None else read_earlier(config)
    if show or (name is None and earlier is None):
        if cluster is not None or part is not None:
            raise CommandError("a list is no work to divide: name a recipe, or leave --cluster and --part out")
        _list(list(RECIPES.values()), as_json)
        return
    if name is not None and earlier is not None:
        raise CommandError(f"--config says what is trained, so leave out {name!r}")
    check_tracker(tracker)
    given = {"algorithm": algorithm, "preset": preset, "name": policy, "total_timesteps": steps}
    values: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    values |= assignments(knobs or [], "--knob", "learning_rate=0.001")
    first = first_seed if first_seed is not None else 0 if earlier is None else earlier.seed
    wanted = range(first, first + (seeds or (5 if earlier is None else 1)))
    chosen = (
        [earlier.recipe]
        if earlier
        else list(RECIPES.values())
        if name == "all"
        else [find_recipe(name or "", algorithm)]
    )
    every = []
    for recipe in chosen:
        against = _opponent(recipe, preset, {"attacker": attacker, "defender": defender})
        recipe = _installed(changed(recipe, {**values, **against, **_venue(recipe, preset, file, overrides)}))
        every.append(_jobs(recipe, wanted, folder, resume=resume, tracker=tracker))
        _check_ship(recipe, ship)
    where, found = workers(jobs, cluster), []
    if part is not None:
        _train_part([job for runs in every for job in runs], part, where)
    for runs in every:
        found.append(_train(runs, where, ship))
        if not as_json:
            _print(runs, found[-1])
    if as_json:
        print_json(found[0] if len(found) == 1 else found)


def _venue(recipe: Recipe, preset: str | None, file: Path | None, changes: list[str] | None) -> dict[str, Any]:
    """The preset and the overrides that are asked for, as knobs of a recipe."""
    if file is None and not changes:
        return {}
    named = preset or (None if file else recipe.preset)
    chosen, overrides = described(find_problem(recipe.problem), named, file, changes)
    return {"preset": chosen or recipe.preset, "overrides": overrides}


def _opponent(recipe: Recipe, preset: str | None, named: Mapping[Role, str | None]) -> dict[str, str]:
    """The opponent to train against: the one that was named, or that of another preset than the recipe's."""
    if named[recipe.role] is not None:
        raise CommandError(f"{recipe.name} trains the {recipe.role}: name its opponent with --{other(recipe.role)}")
    rival = named[other(recipe.role)]
    if rival is None:
        return {} if preset in (None, recipe.preset) else {"opponent": ""}
    return {"opponent": rival}


def _installed(recipe: Recipe) -> Recipe:
    """The recipe, where what trains it is installed."""
    if recipe.algorithm == SHARED:
        require("torch", extra="train", purpose="training")
    return recipe


def _jobs(recipe: Recipe, seeds: range, folder: Path, **how: Any) -> list[TrainingJob]:
    command = describe()["command"]
    home = folder / recipe.name
    return [TrainingJob(recipe, seed, home / f"seed-{seed}", command, **how) for seed in seeds]


def _check_ship(recipe: Recipe, ship: Path | None) -> None:
    if ship is not None and recipe.algorithm == SEARCH:
        raise CommandError(
            f"--to combines networks, and {SEARCH} finds numbers: leave it out, and play what is printed"
        )


def _train_part(runs: list[TrainingJob], part: Part, where: Where) -> None:
    """Do a part of the runs, of all recipes together.

    Raises:
        Unfinished: it is done, and other parts have runs left.
    """
    train_all(part.share(runs), where, f"part {part}")
    if missing := sum(job.read().get("status") != FINISHED for job in runs):
        raise Unfinished(part, "runs", missing)


def _train(runs: list[TrainingJob], where: Where, ship: Path | None) -> dict[str, Any]:
    """What came out; the policies are shipped if asked for."""
    name = runs[0].recipe.name
    results = train_all(runs, where, name)
    if ship is not None:
        merge([job.card for job in runs], ship / f"{name}.json")
        from cps_agents.zoo.references import reference_to

        note(f"Written: {ship / name}.json and {name}.safetensors. They play as {reference_to(ship / f'{name}.json')}")
    return {
        "recipe": name,
        "runs": [{"folder": str(job.folder), **found} for job, found in zip(runs, results, strict=True)],
    }


def _print(runs: list[TrainingJob], found: dict[str, Any]) -> None:
    rows = [
        (str(run["seed"]), f"{run['steps']:,}", f"{run['cpu_s']:.0f}", f"{run['best_score']:.4g}", run["folder"])
        for run in found["runs"]
    ]
    searched = runs[0].recipe.algorithm == SEARCH
    columns = ("seed", "steps", "CPU s", "best validation", "folder" if searched else "zoo:")
    out().print(Sheet(found["recipe"], columns, rows))
    best = max(found["runs"], key=lambda run: float(run["best_score"]))
    from cps_agents.zoo.references import reference_to

    played = best["policy"] if searched else reference_to(runs[0].folder)
    note(f"Play {'the best' if searched else 'one'} with --{runs[0].recipe.role} {shlex.quote(played)}")


def _list(recipes: list[Recipe], as_json: bool) -> None:
    if as_json:
        print_json([knobs_of(recipe) for recipe in recipes])
        return
    columns = ("recipe", "algorithm", "CPU min", "validation")
    out().print(Sheet("Recipes", columns, [_row(recipe) for recipe in recipes], left=2))
    out().print(EXPLANATION, markup=False)


def _row(recipe: Recipe) -> tuple[str, ...]:
    """What a recipe costs and reaches, by the policy that comes with the package."""
    path = SHIPPED / f"{recipe.name}.json"
    start = (recipe.name, recipe.algorithm)
    if not path.is_file():
        return (*start, "", "not shipped")
    seeds = list(read_card(path).seeds.values())
    cpu_min, score = (sum(facts[key] for facts in seeds) / len(seeds) for key in ("cpu_s", "validation"))
    return (*start, f"{cpu_min / 60:.1f}", f"{score:.4g}")
