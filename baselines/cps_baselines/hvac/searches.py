"""Numbers of the HVAC problem's policies that responses in preset `learning` search."""

from __future__ import annotations

from cps_baselines.searches import Searches, SearchSpace

BRINK = {"margin_c2": (0.0, 0.35), "gain": (0.05, 1.0), "most": (0.5, 8.0)}
TRACK = {"level": (0.05, 1.5), "gain": (0.05, 1.0), "noise": (0.3, 1.5), "cap_c": (0.5, 15.0)}
A_TRACKER = {"level": 0.4, "gain": 0.5, "noise": 1.0, "cap_c": 12.0}

SEARCHES: Searches = {
    "attacker": (
        SearchSpace("tracker-cold", "tracker", TRACK, A_TRACKER),
        SearchSpace("tracker-warm", "tracker?warmer=true", TRACK, A_TRACKER),
        SearchSpace("brink-cold", "brink", BRINK),
        SearchSpace("brink-warm", "brink?warmer=true", BRINK),
    ),
    "defender": (
        SearchSpace(
            "cusum",
            "cusum",
            {"kappa": (0.1, 1.0), "limit": (4.0, 30.0), "quiet": (0.1, 0.8), "release_h": (1.0, 12.0)},
            {"kappa": 0.25, "limit": 18.0, "quiet": 0.4, "release_h": 4.0},
        ),
        SearchSpace(
            "largest",
            "largest",
            {"kappa": (0.1, 1.0), "limit": (4.0, 40.0), "release_h": (1.0, 16.0)},
            {"kappa": 0.2, "limit": 20.0, "release_h": 8.0},
        ),
    ),
}
