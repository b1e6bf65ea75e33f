"""Whom each role of the false-data problem meets: in its presets, in training and in the challenge."""

from __future__ import annotations

from collections.abc import Mapping

from cps_envs.core.declare.panel import Contestant, Panel, panel, written
from cps_envs.core.types import Role

CUSUM = written("cusum", drift=0.3, threshold=14.0, rate_threshold=10.0, release_s=2.0, gate=0.01)
CHI2 = written("chi2", gate=0.01)
BANK = written("bank", drift=0.3, threshold=14.0, rate_threshold=10.0, gate=0.01)
TRACKER = written("tracker", margin=0.95, late=1.3, swing=1.1, swing_s=0.1, range_part=1.2, sight=True)
SLOW_MIMIC = written("mimic", acceleration_mps2=0.3)
BY_TASK_AGAINST_BANK = "mimic?by_task=[1.0,0.7,0.85,2.0,3.0,2.0,0.6,0.3]"
BY_TASK_AGAINST_HYPOTHESES = "mimic?by_task=[3.0,0.5,3.0,0.7,3.0,0.4,0.4,0.35]"
FAST_MIMIC = written("mimic", acceleration_mps2=0.7)
SWING = written("swing", swing_s=2.0, open=1.0, close=1.0, range_part=1.0)
MIMICS = {f"mimic?acceleration_mps2={value}": 1.0 for value in (0.2, 0.3, 0.5, 0.8)}  # 0.4 and 0.6 are for judging

OPPONENTS: Mapping[str, Mapping[Role, Panel]] = {  # who plays a role that nobody else plays
    "paper": {"attacker": panel(["oracle"]), "defender": panel(["none"])},
    "easy": {"attacker": panel(["oracle"]), "defender": panel(["none"])},
    "drawn": {"attacker": panel(["bang_bang"]), "defender": panel(["none"])},
    "defense": {"attacker": panel(["none", "oracle?start=random"]), "defender": panel(["none"])},
    "learning": {
        "attacker": panel({"none": 1, "swing": 1, "bang_bang": 1, "blind_tracker": 2, "tracker": 3, **MIMICS}),
        "defender": panel(["cusum"]),
    },
}
RECIPES: Mapping[Role, Panel] = {  # whom our own PPO meets instead; `zoo:fdi-defense` is for judging
    "defender": panel({"cusum": 2, "chi2": 1, "bank": 2, "hypotheses": 2}),
    "attacker": panel(
        {
            "none": 1,
            "swing": 1,
            "bang_bang": 1,
            "blind_tracker": 1,
            "tracker": 3,
            "tracker?margin=1.072&late=2.299&swing=2.032&swing_s=0.9383&range_part=1.052": 2,
            "tracker?margin=0.1534&late=2.725&swing=-0.377&swing_s=2.65&range_part=0.6174": 1,
            **MIMICS,
        }
    ),
}
CHALLENGE: Mapping[Role, Panel] = {  # frozen, searched numbers too: a change is another challenge
    "defender": (
        Contestant("cusum", CUSUM, answer="task_tracker", weight=2.0),
        Contestant("chi2", CHI2, answer="task_tracker"),
        Contestant("bank", BANK, answer=BY_TASK_AGAINST_BANK, weight=2.0),
        Contestant("hypotheses", answer=BY_TASK_AGAINST_HYPOTHESES, weight=2.0),
    ),
    "attacker": (
        Contestant("tracker", TRACKER, answer="informed"),
        Contestant("searched tracker", "task_tracker", answer="informed"),
        Contestant("slow mimic", SLOW_MIMIC, answer="informed"),
        Contestant("fast mimic", FAST_MIMIC, answer="informed"),
        Contestant("swing", SWING, answer="informed", weight=0.5),
    ),
}
EPISODES: Mapping[Role, int] = {"attacker": 4096, "defender": 1024}  # of the challenge, against each opponent
RIVALS: Mapping[Role, Panel] = {  # with whom tests hold what is claimed of `learning`; none is told more
    "attacker": panel(
        [
            *("none", "random", "bang_bang", "swing", "blind_tracker", "tracker"),
            *("task_tracker", "task_tracker?untrained=true"),
        ]
    ),
    "defender": panel(["none", "chi2", "cusum", "bank", "model_only", "hypotheses", "hypotheses?untrained=true"]),
}
