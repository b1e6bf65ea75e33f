"""The dissertation's attackers and defenders as policies, and how their numbers are searched.

Policies are found by name, as in `opponent="mtd2"`. `__all__` is what there is to import; it loads when asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cps_baselines.family import Family as Family
    from cps_baselines.family import Number as Number
    from cps_baselines.family import between as between
    from cps_baselines.hvac.calibrated import calibrate as calibrate

HOMES = {  # name -> module:attribute
    "Family": "cps_baselines.family:Family",
    "Number": "cps_baselines.family:Number",
    "between": "cps_baselines.family:between",
    "calibrate": "cps_baselines.hvac.calibrated:calibrate",  # the threshold of `mtd2` for a building of your own
}
__all__ = [*HOMES]


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = HOMES[name].partition(":")
    globals()[name] = getattr(import_module(module), attribute)
    return globals()[name]
