"""Numbers of the disbanding problem's policies that responses in preset `learning` search."""

from __future__ import annotations

from cps_baselines.searches import Searches, SearchSpace

PLATOONS, JAMS = (1.0, 5.0), (0.0, 9.0)
TIMED = SearchSpace(
    "timed",
    "timed",
    {
        "first": PLATOONS,
        "second": PLATOONS,
        "delay_s": (0.0, 30.0),
        "pause_s": (5.0, 130.0),
        "jam": JAMS,
        "jam_at": (1.0, 3.0),
        "jam_s": (-5.0, 10.0),
    },
    {"first": 1.0, "second": 2.0, "delay_s": 0.0, "pause_s": 60.0, "jam": 1.0, "jam_at": 1.0, "jam_s": -1.0},
)
ADAPTIVE = SearchSpace(
    "adaptive",
    "adaptive?look_s=20",
    {
        "slow_mps": (0.0, 15.0),
        "fast_mps": (10.0, 31.0),
        "slow_s": (21.0, 130.0),
        "middle_s": (21.0, 130.0),
        "fast_s": (21.0, 130.0),
        "jam": JAMS,
        "jam_s": (-5.0, 10.0),
    },
    {"slow_mps": 6.0, "fast_mps": 18.0, "slow_s": 90.0, "middle_s": 60.0, "fast_s": 40.0, "jam": 1.0, "jam_s": -1.0},
)
DETECTION = {"detection_mps": (0.3, 8.0), "hold_s": (0.5, 10.0)}

SEARCHES: Searches = {
    "attacker": (TIMED, ADAPTIVE),
    "defender": (
        SearchSpace("string", "string", DETECTION, {"detection_mps": 2.0, "hold_s": 3.0}),
        SearchSpace("feedback", "feedback", DETECTION, {"detection_mps": 2.0, "hold_s": 3.0}),
    ),
}
