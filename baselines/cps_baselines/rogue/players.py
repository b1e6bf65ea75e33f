"""Who plays in preset `learning`, as `cps-envs contest` and the searches of responses know it."""

from __future__ import annotations

from cps_baselines.arena import Contestant
from cps_baselines.rogue.contested_search import DEFENDERS as RESPONDED_TO

RESPONSES = tuple(Contestant(f"contested {against}", f"contested?against={against}") for against in RESPONDED_TO)
ATTACKERS = (
    Contestant("none"),
    Contestant("square"),
    Contestant("slow_square", "square?frequency_hz=0.05"),
    Contestant("duty_square"),
    Contestant("random"),
    Contestant("switching"),
    *RESPONSES,
    Contestant("identify"),
    Contestant("strike"),
    Contestant("brake_strike", "strike?effort=-1"),
)
DEFENDERS = (
    *(
        Contestant(name)
        for name in ("none", "pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")
    ),
    Contestant("assigned"),
    Contestant("ssl", "assigned?laws=ssl"),
    Contestant("front", "assigned?laws=f"),
    Contestant("monitor"),
)
