"""Numbers of the rogue-vehicle problem's policies that responses in preset `learning` search."""

from __future__ import annotations

from cps_baselines.searches import Searches, SearchSpace

WEIGHT = (-2.0, 2.0)
FORM = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias")

SWITCHING = SearchSpace("switching", "tuned", dict.fromkeys(FORM, WEIGHT) | {"hysteresis": (0.0, 1.0)})
RAMMING = SearchSpace(
    "strike", "strike", {"strike_s": (0.5, 9.0), "period_s": (10.0, 40.0), "effort": (-1.0, 1.0)}, {"effort": 0.9}
)
BRAKING = SearchSpace("brake", "strike", RAMMING.ranges, {"effort": -0.9})
MONITOR = SearchSpace(
    "monitor",
    "monitor",
    {
        "margin_mps": (0.3, 3.0),
        "slack_mps2": (0.5, 5.0),
        "threshold_mps": (0.3, 5.0),
        "release_s": (2.0, 40.0),
        "near_m": (0.0, 30.0),
        "near_strong_m": (10.0, 60.0),
        "strong_mps2": (0.2, 1.5),
        "horizon_s": (0.0, 3.0),
    },
)

SEARCHES: Searches = {"attacker": (SWITCHING, RAMMING, BRAKING), "defender": (MONITOR,)}
