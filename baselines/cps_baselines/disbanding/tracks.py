"""The tracks disbanding-attack and disbanding-defense."""

from __future__ import annotations

from cps_baselines.searched import searched
from cps_baselines.tracks import Rival, Track, written

STRING = written("string", form="warned", hold_s=3.0)
MPC = written("mpc", solver="hildreth")
LOCAL = written("local", hold_s=3.0)
RADIO = written("cacc", told="radio", **searched("disbanding", "cacc_radio"))
PLATOONS = {"first": 1, "second": 2, "third": 3, "delay_s": 0.0, "by_s": 1e9}
JAM_FIRST = written("timed", **PLATOONS, pause_s=60.0, jam=1, jam_at=1, jam_s=-1.0)
JAM_40 = written("timed", **PLATOONS, pause_s=40.0, jam=1, jam_at=1, jam_s=-1.0)
JAM_AFTER_40 = written("timed", **PLATOONS, pause_s=40.0, jam=1, jam_at=1, jam_s=1.0)
JAM_AFTER_60 = written("timed", **PLATOONS, pause_s=60.0, jam=1, jam_at=1, jam_s=1.0)
SPEEDS = {"look_s": 20.0, "slow_mps": 8.161, "fast_mps": 18.12, "slow_s": 60.22, "middle_s": 35.31, "fast_s": 34.91}
ADAPTIVE = written("adaptive", **SPEEDS, jam=1.134, jam_s=-0.832)
RANDOM = written("random", front_bias=0.0)

TRACKS = (
    Track(
        "disbanding",
        "attacker",
        128,
        (
            Rival("string", STRING, JAM_40),
            Rival("mpc", MPC, JAM_40),
            Rival("local", LOCAL, JAM_40),
            Rival("radio", RADIO, JAM_AFTER_40),
            Rival("feedback", "feedback", JAM_AFTER_60, 0.5),
        ),
    ),
    Track(
        "disbanding",
        "defender",
        128,
        (
            Rival("spread", "spread", "informed"),
            Rival("jam first", JAM_FIRST, "informed"),
            Rival("adaptive", ADAPTIVE, "informed"),
            Rival("jam 40", JAM_40, "informed"),
            Rival("random", RANDOM, "informed", 0.5),
        ),
    ),
)
