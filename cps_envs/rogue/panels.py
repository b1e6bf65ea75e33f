"""Whom each role of the rogue-vehicle problem meets: in its presets, in training and in the challenge."""

from __future__ import annotations

from collections.abc import Mapping

from cps_envs.core.declare.panel import Contestant, Panel, panel, written
from cps_envs.core.types import Role

LAWS = {"before": "f", "apart": "fffff"}
MONITOR = written(
    "monitor",
    **LAWS,
    evade="sslll",
    evade_strong="ssssl",
    near_m=20.0,
    near_strong_m=40.0,
    strong_mps2=0.75,
    horizon_s=1.0,
    margin_mps=1.0,
    slack_mps2=3.0,
    threshold_mps=4.0,
    release_s=10.0,
)
SEARCHED_MONITOR = written(
    "monitor",
    **LAWS,
    evade="sslll",
    evade_strong="ssssl",
    near_m=33.4,
    near_strong_m=55.52,
    strong_mps2=1.251,
    horizon_s=0.948,
    margin_mps=0.6596,
    slack_mps2=2.621,
    threshold_mps=1.842,
    release_s=7.56,
)
FOLLOWING = written("assigned", laws="ssl")
TOLD = written("informed", **LAWS, evade="ssssl", near_m=20.0, horizon_s=1.0, delay_s=0.0)


def switching(*weights: float) -> str:
    """The attacker `tuned` with these weights."""
    names = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")
    return written("tuned", **dict(zip(names, weights, strict=True)))


# Each was searched against the defender that it is named after.
AGAINST_MONITOR = switching(3.9233, -3.7543, 0.5004, 1.5819, 4.8439, -4.641, -0.6818)
AGAINST_SLIDING = switching(5.0345, -3.1607, -0.2543, 1.7504, 1.4026, -0.4533, -2.0027)
AGAINST_SLIDING_TOO = switching(1.997, -1.996, -0.2537, 1.036, 0.4105, 0.3777, 0.0007554)
AGAINST_SEARCHED = switching(0.4926, 0.5166, 0.2652, -0.1626, 1.241, -1.997, 0.7751)
AGAINST_MIXTURES = switching(1.4136, -1.7959, -0.0101, 0.08, -0.1166, 0.0719, -0.3459)  # in self-play
SQUARE = written("square", frequency_hz=0.1, duty=0.5)

HIDDEN: Mapping[Role, Panel] = {
    "attacker": panel(
        [
            "none",
            "square?frequency_hz=0.05",
            "duty_square",
            "random",
            "strike",
            "switching",
            "contested?against=sliding",
            "contested?against=monitor",
            "identify",
            "always?action=-1",
        ]
    ),
    "defender": panel(["monitor"]),
}
OPPONENTS: Mapping[str, Mapping[Role, Panel]] = {  # who plays a role that nobody else plays
    "paper": {"attacker": panel(["square"]), "defender": panel(["none"])},
    "oscillation": {"attacker": panel(["gains"]), "defender": panel(["none"])},
    "seats": {"attacker": panel(["square"]), "defender": panel(["none"])},
    "easy": {
        "attacker": panel(
            [
                "square?frequency_hz=0.05",
                "square",
                "duty_square?frequency_hz=0.05",
                "duty_square",
                "random",
                "switching",
            ]
        ),
        "defender": panel(["pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7"]),
    },
    "learning": HIDDEN,
    "city": HIDDEN,
}
TRAINING: Mapping[Role, Panel] = {  # whom learners of the other role meet; others are left for judging
    "attacker": panel(
        {
            "none": 1,
            "square": 2,
            "square?frequency_hz=0.05": 1,
            "duty_square": 1,
            "random": 1,
            "strike": 1,
            "switching": 1,
            "contested?against=sliding": 3,
            "contested?against=monitor": 3,
            "contested?against=pd": 1,
            "contested?against=disband_7": 1,
            "contested?against=assigned?laws=f": 1,
            "identify": 2,
            "always?action=-1": 1,
        }
    ),
    "defender": panel(
        {
            "monitor": 5,
            "sliding": 2,
            "assigned?laws=ssl": 1,
            "assigned?laws=f": 1,
            "assigned": 1,
            "pd_detection": 1,
            "disband_4": 1,
        }
    ),
}
CHALLENGE: Mapping[Role, Panel] = {  # frozen: a change is another challenge
    "defender": (
        Contestant("monitor", MONITOR, answer=AGAINST_MONITOR),
        Contestant("searched monitor", SEARCHED_MONITOR, answer=AGAINST_MONITOR),
        Contestant("ssl", FOLLOWING, answer="contested?against=monitor"),
        Contestant("told", TOLD, answer="contested?against=monitor"),
        Contestant("detection", "sliding_detection", answer="contested?against=monitor"),
    ),
    "attacker": (
        Contestant("against sliding", AGAINST_SLIDING, answer="escort"),
        Contestant("against monitor", AGAINST_MONITOR, answer="escort"),
        Contestant("against searched", AGAINST_SEARCHED, answer="escort"),
        Contestant("against ssl", AGAINST_SLIDING_TOO, answer="escort"),
        Contestant("against mixtures", AGAINST_MIXTURES, answer="escort"),
        Contestant("square", SQUARE, answer="informed", weight=0.5),
    ),
}
EPISODES: Mapping[Role, int] = {"attacker": 1024, "defender": 1024}  # of the challenge, against each opponent
RESPONDED_TO = ("pd", "sliding", "sliding_detection", "disband_7", "assigned", "assigned?laws=f", "monitor")
RIVALS: Mapping[Role, Panel] = {  # with whom tests hold what is claimed of `learning`; none is told more
    "attacker": panel(
        [
            "none",
            "square",
            "square?frequency_hz=0.05",
            "duty_square",
            "random",
            "switching",
            *(f"contested?against={against}" for against in RESPONDED_TO),
            "identify",
            "strike",
            "strike?effort=-1",
        ]
    ),
    "defender": panel(
        [
            *("none", "pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7"),
            *("assigned", "assigned?laws=ssl", "assigned?laws=f", "monitor", "guard"),
        ]
    ),
}
