"""Families of HVAC policies: what the defender `Bayes` believes, and the numbers of two attacks that hide."""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_baselines.family import Family, Number
from cps_baselines.hvac.bayes import Bayes
from cps_baselines.hvac.brink import Brink
from cps_baselines.hvac.hypotheses import START, Beliefs
from cps_baselines.hvac.tracker import Tracker
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
MOST_TOGETHER = 0.85  # beyond that, liars who drift apart are taken for honest sensors


def _bayes(spec: RoleSpec, values: FloatArray) -> Bayes:
    return Bayes(spec, beliefs=[Beliefs(*row) for row in values.tolist()])


def _bayes_together(spec: RoleSpec, values: FloatArray) -> Bayes:
    return _bayes(spec, np.column_stack([values[:, :-1], values[:, -1].clip(0.0, MOST_TOGETHER)]))


def _tracker(spec: RoleSpec, values: FloatArray, *, warmer: bool) -> Tracker:
    level, gain, noise, cap_c = values.T
    return Tracker(spec, level=level, gain=gain, noise=noise, cap_c=cap_c, warmer=warmer)


def _brink(spec: RoleSpec, values: FloatArray) -> Brink:
    margin_c2, gain, most = values.T
    return Brink(spec, margin_c2=margin_c2, gain=gain.clip(max=1.0), most=most)


# Liars who drift each for himself, and liars who drift together.
APART = tuple(
    Number(name, start, getattr(STEP, name), by_factors=True)
    for name, start in START._asdict().items()
    if name != "together"
)
BAYES = Family("hvac", "defender", APART, _bayes)
BAYES_TOGETHER = Family("hvac", "defender", (*APART, Number("together", 0.8, 0.1)), _bayes_together)
TRACKED = (
    Number("level", 0.4, 0.5, by_factors=True),
    Number("gain", 0.5, 0.5, by_factors=True),
    Number("noise", 1.0, 0.2, by_factors=True),
    Number("cap_c", 10.0, 0.4, by_factors=True),
)
TRACKER_COLD = Family("hvac", "attacker", TRACKED, partial(_tracker, warmer=False))
TRACKER_WARM = Family("hvac", "attacker", TRACKED, partial(_tracker, warmer=True))
BRINK = Family(
    "hvac",
    "attacker",
    (
        Number("margin_c2", 0.01, 1.0, by_factors=True),
        Number("gain", 0.8, 0.3, by_factors=True),
        Number("most", 2.0, 0.3, by_factors=True),
    ),
    _brink,
)
