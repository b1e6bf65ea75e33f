"""Families of HVAC policies: what the defender `Bayes` believes, and the numbers of attacks that hide and of tests.

The policies with the numbers that a search found are `bayes` and `warm_tracker`.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_baselines.family import Family, Number, between
from cps_baselines.hvac.bayes import Bayes
from cps_baselines.hvac.hypotheses import START, Beliefs
from cps_baselines.hvac.tracker import Tracker
from cps_baselines.searched import built
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import Policy, RoleSpec
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


# Liars who drift each for himself, and liars who drift together.
APART = tuple(
    Number(name, start, getattr(STEP, name), by_factors=True)
    for name, start in START._asdict().items()
    if name != "together"
)
BAYES = Family("hvac", "defender", "bayes?together=0", APART, _bayes)
BAYES_TOGETHER = Family("hvac", "defender", "bayes", (*APART, Number("together", 0.8, 0.1)), _bayes_together)
TRACKED = (
    Number("level", 0.4, 0.5, by_factors=True, low=0.05, high=1.5),
    Number("gain", 0.5, 0.5, by_factors=True, low=0.05, high=1.0),
    Number("noise", 1.0, 0.2, by_factors=True, low=0.3, high=1.5),
    Number("cap_c", 10.0, 0.4, by_factors=True, low=0.5, high=15.0),
)
TRACKER = Family("hvac", "attacker", "tracker", TRACKED, partial(_tracker, warmer=False))
TRACKER_WARM = Family("hvac", "attacker", "tracker?warmer=true", TRACKED, partial(_tracker, warmer=True))
BRINK = Family(
    "hvac", "attacker", "brink", between({"margin_c2": (0.0, 0.35), "gain": (0.05, 1.0), "most": (0.5, 8.0)})
)
BRINK_WARM = Family("hvac", "attacker", "brink?warmer=true", BRINK.numbers)
CUSUM = Family(
    "hvac",
    "defender",
    "cusum",
    between(
        {"kappa": (0.1, 1.0), "limit": (4.0, 30.0), "quiet": (0.1, 0.8), "release_h": (1.0, 12.0)},
        kappa=0.25,
        limit=18.0,
        quiet=0.4,
        release_h=4.0,
    ),
)
LARGEST = Family(
    "hvac",
    "defender",
    "largest",
    between(
        {"kappa": (0.1, 1.0), "limit": (4.0, 40.0), "release_h": (1.0, 16.0)},
        kappa=0.2,
        limit=20.0,
        release_h=8.0,
    ),
)


@advises("cps_baselines.hvac.advised:Suspecting")
def bayes(spec: RoleSpec, untrained: bool = False, **numbers: float) -> Bayes:
    """Weighs every set of liars by Bayes' rule, and expects liars to drift together.

    `numbers` are those of `Beliefs`; left out, the searched ones of `searched.json`. The search gained nothing that
    could be measured over the hand-set numbers that it began with. `untrained` plays those.

    Raises:
        ConfigurationError: an unknown number, beliefs out of their bounds, or no Kalman filters.
    """
    policy = built(spec, BAYES_TOGETHER, "bayes", numbers, untrained)
    assert isinstance(policy, Bayes)
    return policy


def warm_tracker(spec: RoleSpec, untrained: bool = False, **numbers: float) -> Policy:
    """Plays `tracker` towards warmer readings, more slowly and with less noise: tuned by search against `bayes`.

    `numbers` are `level`, `gain`, `noise` and `cap_c` of `tracker`; left out, those of `searched.json`, or with
    `untrained` those that the search began with.

    Raises:
        ConfigurationError: an unknown number, or what `tracker` refuses.
    """
    return built(spec, TRACKER_WARM, "warm_tracker", numbers, untrained)
