"""How numbers of controllers that ship were searched: `cps-envs --trust train tools.recipes:HvacBayes`, for one."""

from __future__ import annotations

from cps_agents.learning.recipe import Recipe
from tools.recipes.disbanding import CaccBroadcast, CaccLocal, CaccRadio, CaccRobots
from tools.recipes.fdi import FdiHypotheses, FdiTaskTracker
from tools.recipes.hvac import HvacBayes, HvacWarmTracker
from tools.recipes.rogue import RogueBoxIn

SEARCHED: dict[str, Recipe] = {  # by the names that commands in `<problem>/searched.json` have
    recipe.name: recipe
    for recipe in (
        CaccBroadcast(),
        CaccLocal(),
        CaccRadio(),
        CaccRobots(),
        FdiHypotheses(),
        FdiTaskTracker(),
        HvacBayes(),
        HvacWarmTracker(),
        RogueBoxIn(),
    )
}
