"""Who plays in preset `learning`, as `cps-envs contest` and the searches of responses know it."""

from __future__ import annotations

from cps_baselines.rogue.contested_search import DEFENDERS as RESPONDED_TO
from cps_baselines.schedule import Entrant

RESPONSES = tuple(Entrant(f"contested {against}", f"contested?against={against}") for against in RESPONDED_TO)
ATTACKERS = (
    Entrant("none"),
    Entrant("square"),
    Entrant("slow_square", "square?frequency_hz=0.05"),
    Entrant("duty_square"),
    Entrant("random"),
    Entrant("switching"),
    *RESPONSES,
    Entrant("identify"),
    Entrant("strike"),
    Entrant("brake_strike", "strike?effort=-1"),
)
DEFENDERS = (
    *(Entrant(name) for name in ("none", "pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")),
    Entrant("assigned"),
    Entrant("ssl", "assigned?laws=ssl"),
    Entrant("front", "assigned?laws=f"),
    Entrant("monitor"),
)
