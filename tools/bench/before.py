"""What the same rows were before version 0.2, measured by the same measures at commit a4a839c on an AMD EPYC.

Thread gains are those of an idle machine with two cores.
"""

from __future__ import annotations

from collections.abc import Mapping

BEFORE: Mapping[tuple[str, str], Mapping[str, float]] = {
    ("sizes", "rogue 5 vehicles"): {"substep_ns": 13.4},
    ("sizes", "rogue 30 vehicles"): {"substep_ns": 10.6},
    ("sizes", "rogue 100 vehicles"): {"substep_ns": 10.3},
    ("resets", "disbanding paper"): {"reset_us": 19.2},
    ("resets", "disbanding learning"): {"reset_us": 43.0},
    ("resets", "fdi paper"): {"reset_us": 12.4},
    ("resets", "fdi learning"): {"reset_us": 42.0},
    ("resets", "hvac paper"): {"reset_us": 52.6},
    ("resets", "hvac learning"): {"reset_us": 154.0},
    ("resets", "rogue paper"): {"reset_us": 18.9},
    ("resets", "rogue learning"): {"reset_us": 19.7},
    ("threads", "fdi vector 64"): {"speed_up": 0.27},
    ("threads", "disbanding vector 64"): {"speed_up": 1.8},
    ("threads", "disbanding vector 1024"): {"speed_up": 1.95},
    ("threads", "hvac vector 1024"): {"speed_up": 1.5},
    ("threads", "rogue vector 64"): {"speed_up": 1.3},
    ("threads", "rogue vector 1024"): {"speed_up": 1.92},
    ("opponents", "fdi.attacker.usual in learning"): {"times_none_64": 7.35},
    ("opponents", "fdi.attacker.usual in defense"): {"times_none_64": 5.48},
}
