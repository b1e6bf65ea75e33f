"""The defender `Hypotheses` and the attacker `TaskTracker`: families whose numbers a search chooses.

The policies with the numbers that are shipped are `hypotheses` and `task_tracker`.
"""

from __future__ import annotations

import numpy as np

from cps_baselines.family import Family, Number, between
from cps_baselines.fdi.hypotheses import Hypotheses
from cps_baselines.fdi.task_tracker import KINDS, Manner, TaskTracker
from cps_baselines.searched import built
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.types import FloatArray

MOST_MEMORY = 1.0


def _hypotheses(spec: RoleSpec, values: FloatArray) -> Hypotheses:
    numbers = dict(zip(HYPOTHESES.names, values.T, strict=True))
    return Hypotheses(spec, **{**numbers, "memory": numbers["memory"].clip(0.0, MOST_MEMORY)})


HYPOTHESES = Family(
    "fdi",
    "defender",
    "hypotheses",
    (
        Number("range_cost", 0.8, 0.2, by_factors=True),
        Number("rate_cost", 0.8, 0.2, by_factors=True),
        Number("memory", 0.98, 0.005),
        Number("threshold", 12.0, 0.2, by_factors=True),
        Number("per_sensor", 2.0, 0.3, by_factors=True),
        Number("drift_threshold", 5.0, 0.3, by_factors=True),
        Number("release", 0.3, 0.3, by_factors=True),
        Number("outlier", 4.0, 0.15, by_factors=True),
        Number("gate", 4.0, 0.15, by_factors=True),
        Number("correction", 1.0, 0.3, by_factors=True),
        Number("caution", 1.0, 0.3, by_factors=True),
    ),
    _hypotheses,
)


# By hand, those of `tracker`; what it does about readings that are not used comes in by the search.
START = Manner(margin=0.95, late=1.3, swing=1.1, swing_s=0.2, range_part=1.2, shy=0.0, sight=0.8, bold=0.0)  # type: ignore[arg-type]
STEP = Manner(margin=0.2, late=0.2, swing=0.3, swing_s=0.3, range_part=0.2, shy=0.3, sight=0.2, bold=0.3)  # type: ignore[arg-type]


def _task_tracker(spec: RoleSpec, values: FloatArray) -> TaskTracker:
    manners, probe = values[:, :-1].reshape(len(values), len(KINDS), -1).copy(), values[:, -1]
    swing_s, sight = Manner._fields.index("swing_s"), Manner._fields.index("sight")
    manners[..., swing_s] = np.maximum(manners[..., swing_s], 0.0)
    manners[..., sight] = manners[..., sight].clip(0.0, 1.0)
    return TaskTracker(spec, manners, probe)


TRACKER = Family(
    "fdi",
    "attacker",
    "tracker",
    between(
        {
            **dict.fromkeys(("margin", "late", "swing"), (-1.0, 3.0)),
            "swing_s": (0.0, 5.0),
            "range_part": (0.0, 1.5),
        },
        margin=0.8,
        late=1.5,
        swing_s=0.5,
        range_part=1.2,
    ),
)
SWING = Family(
    "fdi",
    "attacker",
    "swing",
    between(
        {"swing_s": (0.0, 6.0), "open": (0.0, 1.0), "close": (0.0, 1.0), "range_part": (0.0, 1.0)},
        swing_s=2.0,
        open=0.9,
        close=0.9,
        range_part=0.9,
    ),
)
CUSUM = Family(
    "fdi",
    "defender",
    "cusum",
    between(
        {"drift": (0.0, 1.0), "threshold": (4.0, 30.0), "rate_threshold": (3.0, 30.0), "release_s": (0.1, 6.0)},
        drift=0.3,
        threshold=14.0,
        release_s=2.0,
    ),
)
TASK_TRACKER = Family(
    "fdi",
    "attacker",
    "task_tracker",
    (
        *(
            Number(f"{kind}.{name}", getattr(START, name), getattr(STEP, name))
            for kind in KINDS
            for name in Manner._fields
        ),
        Number("probe", 5.0, 0.2, by_factors=True),
    ),
    _task_tracker,
)


def hypotheses(spec: RoleSpec, untrained: bool = False, **numbers: float) -> Policy:
    """Follows the likeliest hypothesis about which sensors lie, once the evidence for it is strong enough.

    `numbers` are those of `Hypotheses`; left out, the searched ones of `searched.json`, or with `untrained` the
    hand-set ones that the search began with.

    Raises:
        ConfigurationError: an unknown number, or what `Hypotheses` refuses.
    """
    return built(spec, HYPOTHESES, "hypotheses", numbers, untrained)


@advises("cps_baselines.fdi.advised:Margins")
def task_tracker(spec: RoleSpec, untrained: bool = False, **numbers: float) -> TaskTracker:
    """Plays `tracker` with numbers for each kind of task, after a probe that shows whether anybody defends.

    `numbers` are `probe` and, for each kind, those of `Manner`, such as `one.margin`; left out, the searched ones of
    `searched.json`, or with `untrained` the hand-set ones that the search began with.

    Raises:
        ConfigurationError: an unknown number, or what `tracker` refuses.
    """
    policy = built(spec, TASK_TRACKER, "task_tracker", numbers, untrained)
    assert isinstance(policy, TaskTracker)
    return policy
