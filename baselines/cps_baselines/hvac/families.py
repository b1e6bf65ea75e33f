"""The defender `Bayes` as a family of policies whose beliefs a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.hvac.bayes import Bayes
from cps_baselines.hvac.hypotheses import START, Beliefs
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

STEP = Beliefs(  # of the logarithm of each number
    onset_per_h=0.7,
    further_liar=0.3,
    growth_c_per_h=0.4,
    growth_h=0.4,
    walk_c=0.3,
    bold=0.3,
    still=0.3,
    still_noise=0.1,
    still_walk_c=0.2,
    change_per_h=0.3,
    heat_w=0.2,
    trust=0.2,
    too_cold=0.4,
)


def _bayes(spec: RoleSpec, values: FloatArray) -> Bayes:
    return Bayes(spec, beliefs=[Beliefs(*row) for row in values.tolist()])


BAYES = Family(
    "hvac",
    "defender",
    tuple(Number(name, start, getattr(STEP, name), by_factors=True) for name, start in START._asdict().items()),
    _bayes,
)
