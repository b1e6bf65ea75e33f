"""Whom each role of the disbanding problem meets: in its presets, in training and in the challenge."""

from __future__ import annotations

from collections.abc import Mapping

from cps_envs.core.declare.panel import Contestant, Panel, panel, written
from cps_envs.core.types import Role

STRING = written("string", form="warned", hold_s=3.0)
MPC = written("mpc", solver="hildreth")
LOCAL = written("local", hold_s=3.0)
PLATOONS = {"first": 1, "second": 2, "third": 3, "delay_s": 0.0, "by_s": 1e9}
JAM_FIRST = written("timed", **PLATOONS, pause_s=60.0, jam=1, jam_at=1, jam_s=-1.0)
JAM_40 = written("timed", **PLATOONS, pause_s=40.0, jam=1, jam_at=1, jam_s=-1.0)
JAM_AFTER_40 = written("timed", **PLATOONS, pause_s=40.0, jam=1, jam_at=1, jam_s=1.0)
JAM_AFTER_60 = written("timed", **PLATOONS, pause_s=60.0, jam=1, jam_at=1, jam_s=1.0)
SPEEDS = {"look_s": 20.0, "slow_mps": 8.161, "fast_mps": 18.12, "slow_s": 60.22, "middle_s": 35.31, "fast_s": 34.91}
ADAPTIVE = written("adaptive", **SPEEDS, jam=1.134, jam_s=-0.832)
RANDOM = written("random", front_bias=0.0)

OPPONENTS: Mapping[str, Mapping[Role, Panel]] = {  # who plays a role that nobody else plays
    "paper": {"attacker": panel(["lead"]), "defender": panel(["none"])},
    "one_vehicle": {"attacker": panel(["lead"]), "defender": panel(["none"])},
    "drivers": {"attacker": panel(["shake"]), "defender": panel(["none"])},
    "easy": {"attacker": panel(["random"]), "defender": panel(["none"])},
    "learning": {
        "attacker": panel(["none", "spread", "random", "timed?jam=1", "timed?jam=2", "timed?jam=3"]),
        "defender": panel(["string?detection_mps=0"]),
    },
}
TRAINING: Mapping[Role, Panel] = {  # whom learners of the other role meet
    # Defenders of differing kinds; `feedback` weighs half in the challenge, too. A jam before the first attack deceives
    # `heuristic` and `mpc`, who wait to be told of it, one after it who also detects. `mpc` is left for judging.
    "defender": panel({"heuristic": 1.0, "string": 1.0, "cacc?told=radio": 1.0, "feedback": 0.5}),
    # Who does nothing teaches nothing; the quiet episodes are enough to show what an alarm costs.
    "attacker": panel(["spread", "random", "timed?jam=1", "timed?jam=2", "timed?jam=3"]),
}
CHALLENGE: Mapping[Role, Panel] = {  # frozen, searched numbers too: a change is another challenge
    "defender": (
        Contestant("string", STRING, answer=JAM_40),
        Contestant("mpc", MPC, answer=JAM_40),
        Contestant("local", LOCAL, answer=JAM_40),
        Contestant("radio", "cacc?told=radio", answer=JAM_AFTER_40),
        Contestant("feedback", answer=JAM_AFTER_60, weight=0.5),
    ),
    "attacker": (
        Contestant("spread", answer="informed"),
        Contestant("jam first", JAM_FIRST, answer="informed"),
        Contestant("adaptive", ADAPTIVE, answer="informed"),
        Contestant("jam 40", JAM_40, answer="informed"),
        Contestant("random", RANDOM, answer="informed", weight=0.5),
    ),
}
EPISODES: Mapping[Role, int] = {"attacker": 128, "defender": 128}  # of the challenge, against each opponent
RIVALS: Mapping[Role, Panel] = {  # with whom tests hold what is claimed of `learning`; none is told more
    "attacker": panel(
        [
            *("none", "lead", "table_2_3", "spread", "random", "timed", "adaptive"),
            *("timed?jam=1", "timed?jam=2", "timed?jam=3&jam_s=0", "timed?jam=1&jam_s=0&pause_s=40"),
            "adaptive?look_s=20&slow_mps=8.2&fast_mps=18.1&slow_s=60&middle_s=35&fast_s=35&jam=1",
        ]
    ),
    "defender": panel(
        [
            *("none", "heuristic", "mpc", "copy", "feedback", "string", "local"),
            *("cacc", "cacc?untrained=true", "cacc?told=radio", "cacc?told=radio&untrained=true"),
        ]
    ),
}
