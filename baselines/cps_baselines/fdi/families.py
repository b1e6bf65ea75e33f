"""The defender `Hypotheses` as a family of policies whose numbers a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.fdi.hypotheses import Hypotheses
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

MOST_MEMORY = 1.0


def _hypotheses(spec: RoleSpec, values: FloatArray) -> Hypotheses:
    numbers = dict(zip(HYPOTHESES.names, values.T, strict=True))
    return Hypotheses(spec, **{**numbers, "memory": numbers["memory"].clip(0.0, MOST_MEMORY)})


HYPOTHESES = Family(
    "fdi",
    "defender",
    (
        Number("range_cost", 0.8, 0.2, by_factors=True),
        Number("rate_cost", 0.8, 0.2, by_factors=True),
        Number("memory", 0.98, 0.005),
        Number("threshold", 12.0, 0.2, by_factors=True),
        Number("per_sensor", 2.0, 0.3, by_factors=True),
        Number("drift_threshold", 5.0, 0.3, by_factors=True),
        Number("release", 0.3, 0.3, by_factors=True),
        Number("outlier", 3.0, 0.15, by_factors=True),
        Number("gate", 3.0, 0.15, by_factors=True),
        Number("correction", 1.0, 0.3, by_factors=True),
        Number("caution", 1.0, 0.3, by_factors=True),
    ),
    _hypotheses,
)
