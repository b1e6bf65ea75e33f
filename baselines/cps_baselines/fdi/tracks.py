"""The tracks fdi-attack and fdi-defense."""

from __future__ import annotations

from cps_baselines.searched import searched
from cps_baselines.tracks import Rival, Track, written

CUSUM = written("cusum", drift=0.3, threshold=14.0, rate_threshold=10.0, release_s=2.0, gate=0.01)
CHI2 = written("chi2", gate=0.01)
BANK = written("bank", drift=0.3, threshold=14.0, rate_threshold=10.0, gate=0.01)
HYPOTHESES = written("hypotheses", **searched("fdi", "hypotheses"))
SEARCHED_TRACKER = written("task_tracker", **searched("fdi", "task_tracker"))
TRACKER = written("tracker", margin=0.95, late=1.3, swing=1.1, swing_s=0.1, range_part=1.2, sight=True)
SLOW_MIMIC = written("mimic", acceleration_mps2=0.3)
BY_TASK_AGAINST_BANK = "mimic?by_task=[1.0,0.7,0.85,2.0,3.0,2.0,0.6,0.3]"
BY_TASK_AGAINST_HYPOTHESES = "mimic?by_task=[3.0,0.5,3.0,0.7,3.0,0.4,0.4,0.35]"
FAST_MIMIC = written("mimic", acceleration_mps2=0.7)
SWING = written("swing", swing_s=2.0, open=1.0, close=1.0, range_part=1.0)

TRACKS = (
    Track(
        "fdi",
        "attacker",
        4096,
        (
            Rival("cusum", CUSUM, SEARCHED_TRACKER, 2.0),
            Rival("chi2", CHI2, SEARCHED_TRACKER),
            Rival("bank", BANK, BY_TASK_AGAINST_BANK, 2.0),
            Rival("hypotheses", HYPOTHESES, BY_TASK_AGAINST_HYPOTHESES, 2.0),
        ),
    ),
    Track(
        "fdi",
        "defender",
        1024,
        (
            Rival("tracker", TRACKER, "informed"),
            Rival("searched tracker", SEARCHED_TRACKER, "informed"),
            Rival("slow mimic", SLOW_MIMIC, "informed"),
            Rival("fast mimic", FAST_MIMIC, "informed"),
            Rival("swing", SWING, "informed", 0.5),
        ),
    ),
)
