"""Learners, trained policies, and the means to judge them.

`__all__` is the public interface; what is behind it loads when it is first asked for. `sb3` and `torchrl` are modules
that need the library of this name.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cps_agents import sb3 as sb3
    from cps_agents import torchrl as torchrl
    from cps_agents.datasets import dataset_name as dataset_name
    from cps_agents.datasets import write_dataset as write_dataset
    from cps_agents.league.strategy import mix as mix
    from cps_agents.learning.learner import learn as learn
    from cps_agents.learning.recipe import Recipe as Recipe
    from cps_agents.learning.recipe import changed as changed
    from cps_agents.learning.run import TrainingJob as TrainingJob
    from cps_agents.recipes.finding import find_recipe as find_recipe
    from cps_agents.scoring.score import score as score
    from cps_agents.zoo.own import save_network as save_network

HOMES = {  # name -> module, or module:attribute
    "sb3": "cps_agents.sb3",
    "torchrl": "cps_agents.torchrl",
    "score": "cps_agents.scoring.score:score",
    "save_network": "cps_agents.zoo.own:save_network",
    "write_dataset": "cps_agents.datasets:write_dataset",
    "dataset_name": "cps_agents.datasets:dataset_name",
    "mix": "cps_agents.league.strategy:mix",
    "learn": "cps_agents.learning.learner:learn",
    "TrainingJob": "cps_agents.learning.run:TrainingJob",
    "Recipe": "cps_agents.learning.recipe:Recipe",
    "changed": "cps_agents.learning.recipe:changed",
    "find_recipe": "cps_agents.recipes.finding:find_recipe",
}
__all__ = [*HOMES]


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = HOMES[name].partition(":")
    found = import_module(module)
    globals()[name] = getattr(found, attribute) if attribute else found
    return globals()[name]
