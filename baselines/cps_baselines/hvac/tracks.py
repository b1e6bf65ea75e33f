"""The tracks hvac-attack and hvac-defense."""

from __future__ import annotations

from cps_baselines.searched import searched
from cps_baselines.tracks import Rival, Track, written

MTD2 = written("mtd2", fallback="least_mean")
LARGEST = written("largest", kappa=0.2, limit=20.0, release_h=8.0, smooth=0.35)
CUSUM = written("cusum", kappa=0.25, limit=18.0, quiet=0.4, release_h=4.0, smooth=0.35)
BAYES = written("bayes", **searched("hvac", "bayes"))
TRACKER = {"level": 0.4, "gain": 0.5, "noise": 1.0, "cap_c": 15.0}
COLDER = written("tracker", **TRACKER, warmer=False)
WARMER = written("tracker", **TRACKER, warmer=True)
SEARCHED = written("tracker", level=0.4279, gain=0.1971, noise=0.7804, cap_c=10.14, warmer=True)
AGAINST_LARGEST = written("tracker", level=0.5845, gain=0.415, noise=1.5, cap_c=1.209, warmer=True)
BRINK = written("brink", margin_c2=0.01, gain=1.0, most=2.0, warmer=False)
HEAT_LOSS = written("mimic", loss_w=100.0, keep_noise=True, warmer=False)
RAMP = written("ramp", rate_c_per_h=1.0, exponent=1.0, keep_noise=True, warmer=True)
HOT = written("constant", reading_c=40.0)

TRACKS = (
    Track(
        "hvac",
        "attacker",
        2048,
        (
            Rival("mtd2", MTD2, BRINK),
            Rival("largest", LARGEST, COLDER),
            Rival("cusum", CUSUM, COLDER),
            Rival("bayes", BAYES, SEARCHED, 2.0),
        ),
    ),
    Track(
        "hvac",
        "defender",
        512,
        (
            Rival("tracker", COLDER, "informed"),
            Rival("warm tracker", WARMER, "informed"),
            Rival("noisy mimic", HEAT_LOSS, "informed"),
            Rival("noisy ramp", RAMP, "informed"),
            Rival("searched tracker", SEARCHED, "informed"),
            Rival("40 C", HOT, "informed", 0.5),
        ),
    ),
)
