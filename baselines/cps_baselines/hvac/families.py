"""The defender `Bayes` as a family of policies whose beliefs a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.hvac.bayes import Bayes
from cps_baselines.hvac.hypotheses import START, Beliefs
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

STEP = 0.5  # of the logarithm of each number


def _bayes(spec: RoleSpec, values: FloatArray) -> Bayes:
    return Bayes(spec, beliefs=[Beliefs(*row) for row in values.tolist()])


BAYES = Family(
    "hvac",
    "defender",
    tuple(Number(name, start, STEP, by_factors=True) for name, start in START._asdict().items()),
    _bayes,
)
