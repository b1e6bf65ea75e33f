"""Numbers of the policies of false data injection that responses in preset `learning` search."""

from __future__ import annotations

from cps_baselines.searches import Searches, SearchSpace

TRACKER = {
    "margin": (-1.0, 3.0),
    "late": (-1.0, 3.0),
    "swing": (-1.0, 3.0),
    "swing_s": (0.0, 5.0),
    "range_part": (0.0, 1.5),
}
SWING = {"swing_s": (0.0, 6.0), "open": (0.0, 1.0), "close": (0.0, 1.0), "range_part": (0.0, 1.0)}
CUSUM = {"drift": (0.0, 1.0), "threshold": (4.0, 30.0), "rate_threshold": (3.0, 30.0), "release_s": (0.1, 6.0)}

SEARCHES: Searches = {
    "attacker": (
        SearchSpace("tracker", "tracker", TRACKER, {"margin": 0.8, "late": 1.5, "swing_s": 0.5, "range_part": 1.2}),
        SearchSpace("swing", "swing", SWING, {"swing_s": 2.0, "open": 0.9, "close": 0.9, "range_part": 0.9}),
    ),
    "defender": (SearchSpace("cusum", "cusum", CUSUM, {"drift": 0.3, "threshold": 14.0, "release_s": 2.0}),),
}
