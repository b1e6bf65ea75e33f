"""Whom each role of the HVAC problem meets: in its presets, in training and in the challenge."""

from __future__ import annotations

from collections.abc import Mapping

from cps_envs.core.declare.panel import Contestant, Panel, panel, written
from cps_envs.core.types import Role

MTD2 = written("mtd2", fallback="least_mean")
LARGEST = written("largest", kappa=0.2, limit=20.0, release_h=8.0, smooth=0.35)
CUSUM = written("cusum", kappa=0.25, limit=18.0, quiet=0.4, release_h=4.0, smooth=0.35)
TRACKER = {"level": 0.4, "gain": 0.5, "noise": 1.0, "cap_c": 15.0}
COLDER = written("tracker", **TRACKER, warmer=False)
WARMER = written("tracker", **TRACKER, warmer=True)
SEARCHED = written("tracker", level=0.4279, gain=0.1971, noise=0.7804, cap_c=10.14, warmer=True)
BRINK = written("brink", margin_c2=0.01, gain=1.0, most=2.0, warmer=False)
HEAT_LOSS = written("mimic", loss_w=100.0, keep_noise=True, warmer=False)
RAMP = written("ramp", rate_c_per_h=1.0, exponent=1.0, keep_noise=True, warmer=True)
HOT = written("constant", reading_c=40.0)

# 15 % of the days without attack, 30 % with scripted attacks, 55 % with stealthy ones.
EASY_ATTACKERS = panel(
    {"none": 3, "constant": 2, "sine": 2, "random": 2, "ramp?rate_c_per_h=[0.3,1.0]": 5, "root_ramp": 3, "mimic": 3}
)
DRAWN_RAMP = "ramp?rate_c_per_h=[0.3,1.0]"
LEARNING_ATTACKERS = panel(  # attacks of both signs with equal weight
    {
        "none": 2,
        "constant": 2,
        "constant?reading_c=28": 1,
        "constant?reading_c=40": 1,
        f"{DRAWN_RAMP}&keep_noise=true": 3,
        f"{DRAWN_RAMP}&keep_noise=true&warmer=true": 3,
        f"{DRAWN_RAMP}&exponent=0.5&keep_noise=true": 3,
        f"{DRAWN_RAMP}&exponent=0.5&keep_noise=true&warmer=true": 3,
        "mimic?keep_noise=true": 2,
        "mimic?keep_noise=true&warmer=true": 2,
        "brink": 2,
        "brink?warmer=true": 2,
        "tracker": 3,
        "tracker?warmer=true": 3,
    }
)
OPPONENTS: Mapping[str, Mapping[Role, Panel]] = {  # who plays a role that nobody else plays
    "paper": {"attacker": panel(["constant"]), "defender": panel(["mtd2"])},
    "easy": {"attacker": EASY_ATTACKERS, "defender": panel(["mtd2"])},
    "learning": {"attacker": LEARNING_ATTACKERS, "defender": panel(["largest"])},
    "hard": {"attacker": LEARNING_ATTACKERS, "defender": panel(["largest"])},
    "weather": {"attacker": LEARNING_ATTACKERS, "defender": panel(["largest"])},
}
RECIPES: Mapping[Role, Panel] = {"defender": panel(["largest"])}  # opponents that opposite signs fool teach less
CHALLENGE: Mapping[Role, Panel] = {  # frozen, searched numbers too: a change is another challenge
    "defender": (
        Contestant("mtd2", MTD2, answer=BRINK),
        Contestant("largest", LARGEST, answer=COLDER),
        Contestant("cusum", CUSUM, answer=COLDER),
        Contestant("bayes", answer=SEARCHED, weight=2.0),
    ),
    "attacker": (
        Contestant("tracker", COLDER, answer="informed"),
        Contestant("warm tracker", WARMER, answer="informed"),
        Contestant("noisy mimic", HEAT_LOSS, answer="informed"),
        Contestant("noisy ramp", RAMP, answer="informed"),
        Contestant("searched tracker", SEARCHED, answer="informed"),
        Contestant("40 C", HOT, answer="informed", weight=0.5),
    ),
}
BOTH_SIGNS = (  # they show zones colder than they are, or with an option warmer
    *("ramp", "root_ramp", "mimic", "brink", "tracker"),
    *("ramp?keep_noise=true", "mimic?keep_noise=true", "ramp?rate_c_per_h=0.6&exponent=0.5&keep_noise=true"),
)
EPISODES: Mapping[Role, int] = {"attacker": 2048, "defender": 512}  # of the challenge, against each opponent
RIVALS: Mapping[Role, Panel] = {  # with whom tests hold what is claimed of `learning`; none is told more
    "attacker": panel(
        [
            *("none", "constant", "sine", "random", "constant?reading_c=28", "constant?reading_c=40"),
            *BOTH_SIGNS,
            *(f"{each}{'&' if '?' in each else '?'}warmer=true" for each in BOTH_SIGNS),
            *("warm_tracker", "warm_tracker?untrained=true"),
        ]
    ),
    "defender": panel(
        [
            *("none", "fixed", "mtd1", "mtd2", "model_only", "largest", "cusum"),
            *("bayes", "bayes?untrained=true"),
        ]
    ),
}
