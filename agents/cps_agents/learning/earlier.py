"""An earlier training run as its `run.json` tells it, to be trained again."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import Recipe, changed
from cps_agents.learning.run import MOST_STEPS
from cps_agents.recipes.finding import RECIPES
from cps_envs.core.documents import read_entry


class Earlier(NamedTuple):
    """What an earlier run was."""

    recipe: Recipe
    seed: int


def read_earlier(path: Path) -> Earlier:
    """Recipe and seed of a run's `run.json`.

    Raises:
        DamagedFileError: it is no record of a training run.
        CommandError: no such file, or its recipe is not one that this version knows.
    """
    if not path.is_file():
        raise CommandError(f"{path} is not a file: name the run.json of a training run")
    found = read_entry(path, "record of a training run", "Name the run.json of a training run.")
    knobs, seed, base = found["recipe"].plain(), found["seed"].whole(0, MOST_STEPS), found["base"].text()
    if base and base not in RECIPES:
        raise CommandError(f"{path} is of the recipe {base!r}, which this version does not have")
    return Earlier(changed(RECIPES.get(base, Recipe()), knobs), seed)
