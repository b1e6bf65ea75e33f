"""Axes and names of the chapter's figures, some of which the paper leaves out (specification 3)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

PASS, SOLID = "pass", "solid"
CONTACTS: Mapping[str, str] = {PASS: "m", SOLID: "m/s"}  # unit of the damage
MAPS: Mapping[str, str] = {  # figure -> defender
    "5.6": "pd",
    "5.7": "sliding",
    "5.8": "sliding_detection",
    "5.9": "disband_2",
    "5.10": "disband_4",
    "5.11": "disband_7",
}
FIGURES: Mapping[str, str] = {defender: figure for figure, defender in MAPS.items()}
DETECTION_OVER_LINEAR = "pd_detection"  # Fig. 5.1b read with section 5.2.3; in no map of the paper
TITLES: Mapping[str, str] = {
    DETECTION_OVER_LINEAR: "linear with detection",
    "pd": "linear bidirectional",
    "sliding": "sliding mode",
    "sliding_detection": "sliding mode with detection",
    "disband_2": "modified, +2 m",
    "disband_4": "modified, +4 m",
    "disband_7": "modified, +7 m",
}
FREQUENCIES_HZ = tuple(np.round(np.linspace(0.02, 0.5, 17), 3).tolist())  # chosen
CIRCLED = "disband_7"  # whose errors Fig. 5.4 shows
COURSES = {"5.3": ("sliding", "sliding_detection"), "5.5": ("disband_2",)}
RATIOS = (1.0, 1.1, 1.2, 1.3, 1.4)  # chosen
DISBANDING = ("disband_2", "disband_4", "disband_7")
COURSE_FREQUENCIES_HZ = (0.02, 0.05, 0.1)  # chosen; the paper names none for Figs. 5.3 and 5.5
DRAWN_HZ = 0.05  # of these, the one that the figures show
LEARNING_S = 60.0  # duration of the learning problem
STEADY_HZ = tuple(np.round(np.linspace(0.01, 0.6, 40), 4).tolist())  # among which the best square wave is sought
SEATED = (*MAPS.values(), DETECTION_OVER_LINEAR)  # who plays with the attacker in other seats
SEATS: Mapping[int, tuple[int, ...]] = {5: (1, 2, 3, 4), 10: (1, 5, 9)}  # of so many vehicles; 1 = rear; chosen
SEAT_RATIOS = (1.0, 1.2, 1.4)  # chosen: three of `RATIOS`, since the maps are many
FINE_S = 0.0005  # integration step that is stable for all of these
SWAYS = ("gains?derivative=3", "gains")  # the gains of (5.15) after a kick, and the sign of k_d reversed
WIDE_RATIOS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
