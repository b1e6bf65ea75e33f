"""The tracks rogue-attack and rogue-defense."""

from __future__ import annotations

from cps_baselines.tracks import Rival, Track, written

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

TRACKS = (
    Track(
        "rogue",
        "attacker",
        1024,
        (
            Rival("monitor", MONITOR, AGAINST_MONITOR),
            Rival("searched monitor", SEARCHED_MONITOR, AGAINST_MONITOR),
            Rival("ssl", FOLLOWING, "contested?against=monitor"),
            Rival("told", TOLD, "contested?against=monitor"),
            Rival("detection", "sliding_detection", "contested?against=monitor"),
        ),
    ),
    Track(
        "rogue",
        "defender",
        1024,
        (
            Rival("against sliding", AGAINST_SLIDING, "escort"),
            Rival("against monitor", AGAINST_MONITOR, "escort"),
            Rival("against searched", AGAINST_SEARCHED, "escort"),
            Rival("against ssl", AGAINST_SLIDING_TOO, "escort"),
            Rival("against mixtures", AGAINST_MIXTURES, "escort"),
            Rival("square", SQUARE, "informed", 0.5),
        ),
    ),
)
