"""The dissertation's attackers and defenders as policies, and how their numbers are searched.

Policies are found by name, as in `opponent="mtd2"`. `__all__` is what there is to import; it loads when asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cps_baselines.family import Family as Family
    from cps_baselines.family import Number as Number
    from cps_baselines.hvac.calibrated import calibrate as calibrate
    from cps_baselines.searches import SearchSpace as SearchSpace

HOMES = {  # name -> module:attribute
    "Family": "cps_baselines.family:Family",
    "Number": "cps_baselines.family:Number",
    "SearchSpace": "cps_baselines.searches:SearchSpace",
    "calibrate": "cps_baselines.hvac.calibrated:calibrate",  # the threshold of `mtd2` for a building of your own
}
__all__ = [*HOMES]


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = HOMES[name].partition(":")
    globals()[name] = getattr(import_module(module), attribute)
    return globals()[name]
