"""An earlier training run as its `run.json` tells it, to be trained again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from agents.errors import CommandError
from agents.learning.recipe import Recipe, changed
from agents.recipes.finding import RECIPES


class Earlier(NamedTuple):
    """What an earlier run was."""

    recipe: Recipe
    seed: int


def read_earlier(path: Path) -> Earlier:
    """Recipe and seed of a run's `run.json`.

    Raises:
        CommandError: no such file, it is damaged, or its recipe is not one that this version knows.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        knobs, seed, base = dict(found["recipe"]), int(found["seed"]), str(found["base"])
    except OSError as error:
        raise CommandError(f"{path} cannot be read ({error.strerror}): name the run.json of a training run") from error
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise CommandError(f"{path} is not the run.json of a training run ({error!r})") from error
    if base and base not in RECIPES:
        raise CommandError(f"{path} is of the recipe {base!r}, which this version does not have")
    return Earlier(changed(RECIPES.get(base, Recipe()), knobs), seed)
