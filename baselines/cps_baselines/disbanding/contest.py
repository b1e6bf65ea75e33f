"""What `cps-envs contest disbanding` plays: attacks and jams against defenders who learn of them late."""

from __future__ import annotations

import json
from collections.abc import Iterator

from cps_baselines.arena import Contestant
from cps_baselines.contest import SELF_PLAY, Column, Contest, Search, Side, Variant
from cps_envs.disbanding.config import LEARNING

ATTACKS = LEARNING.num_attacks
LEVELS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # shares of 6 m/s2, of either sign
ONE_PLAN = "needs a list of events; `timed` and `spread` play plans that fit every episode"
MEASURED = "`python -m cps_baselines.disbanding.yardsticks learning` plays it"
OTHER_SPACES = "trained in preset easy, whose observations and actions are others"
NO_JAM = "found in preset easy, where no radio link can be jammed"
OTHER_WARNING = "found in presets paper and easy, where the warning is perfect and corrections act behind attacks alone"

ATTACKERS = (
    *(Contestant(name) for name in ("none", "lead", "table_2_3", "spread", "random", "timed", "adaptive")),
    Contestant("jam_first", "timed?jam=1", "timed, jam behind the first"),
    Contestant("jam_second", "timed?jam=2", "timed, jam behind the next"),
    Contestant("jam_after", "timed?jam=3&jam_s=0", "timed, jam after the attack"),
)
DEFENDERS = tuple(map(Contestant, ("none", "heuristic", "mpc", "copy", "feedback", "string", "local")))

PLATOONS, JAMS = (1.0, 5.0), (0.0, 9.0)
TIMED = Search(
    "timed",
    "timed",
    {
        "first": PLATOONS,
        "second": PLATOONS,
        "delay_s": (0.0, 30.0),
        "pause_s": (5.0, 130.0),
        "jam": JAMS,
        "jam_at": (1.0, 3.0),
        "jam_s": (-5.0, 10.0),
    },
    {"first": 1.0, "second": 2.0, "delay_s": 0.0, "pause_s": 60.0, "jam": 1.0, "jam_at": 1.0, "jam_s": -1.0},
)
ADAPTIVE = Search(
    "adaptive",
    "adaptive?look_s=20",
    {
        "slow_mps": (0.0, 15.0),
        "fast_mps": (10.0, 31.0),
        "slow_s": (21.0, 130.0),
        "middle_s": (21.0, 130.0),
        "fast_s": (21.0, 130.0),
        "jam": JAMS,
        "jam_s": (-5.0, 10.0),
    },
    {"slow_mps": 6.0, "fast_mps": 18.0, "slow_s": 90.0, "middle_s": 60.0, "fast_s": 40.0, "jam": 1.0, "jam_s": -1.0},
)
DETECTION = {"detection_mps": (0.3, 8.0), "hold_s": (0.5, 10.0)}


def constant_corrections() -> Iterator[str]:
    """The same correction of all vehicles, of the leaders, of the others, and of the rear half."""
    size, vehicles = LEARNING.vehicles_per_platoon, LEARNING.max_vehicles
    leaders = [float(q % size == 0) for q in range(vehicles)]
    rear = [float(q >= vehicles // 2) for q in range(vehicles)]
    for level in sorted((*LEVELS, *(-level for level in LEVELS))):
        yield f"always?action={level}"
        for shares in (leaders, [1.0 - share for share in leaders], rear):
            yield f"always?action={json.dumps([level * share for share in shares], separators=(',', ':'))}"


CONTEST = Contest(
    problem="disbanding",
    attackers=Side(
        policies=ATTACKERS,
        constants=tuple(f"always?action={action}" for action in range(ATTACKS)),
        searches=(TIMED, ADAPTIVE),
        margin_neutral=5.0,
        left_out={
            "plan": ONE_PLAN,
            "every_other": "needs a budget of five platoons",
            "ga": "plans on copies of each episode for half a minute, and knows what will be drawn in it",
            "zoo:disbanding-attack-ppo": OTHER_SPACES,
            "zoo:disbanding-attack-mixture": SELF_PLAY,
            "zoo:disbanding-attack-cma": NO_JAM,
        },
    ),
    defenders=Side(
        policies=(*DEFENDERS, Contestant("zoo:disbanding-defense-radio-cma")),
        constants=tuple(constant_corrections()),
        informed=(Contestant("informed"),),
        searches=(
            Search("string", "string", DETECTION, {"detection_mps": 2.0, "hold_s": 3.0}),
            Search("feedback", "feedback", DETECTION, {"detection_mps": 2.0, "hold_s": 3.0}),
        ),
        margin_informed=0.5,
        margin_neutral=5.0,
        left_out={
            "random": "draws every action anew, which is no defence; `cps-envs learnability` plays it",
            "mpc_tuned": f"half a second for an episode; {MEASURED}",
            "joint": f"a second for an episode; {MEASURED}",
            "zoo:disbanding-defense-ppo": OTHER_SPACES,
            "zoo:disbanding-defense-mixture": SELF_PLAY,
            "zoo:disbanding-defense-cma": OTHER_WARNING,
            "zoo:disbanding-defense-local-cma": OTHER_WARNING,
            "zoo:disbanding-defense-residual": OTHER_WARNING,
            "zoo:disbanding-defense-testbed-cma": "found for nine robots, whose speeds and gaps are others",
        },
    ),
    variants=(
        Variant("learning", "Radio drawn, a quarter of the episodes without attack"),
        Variant("hop-0.1-loss-10", "0.1 s and 10 % lost per link", overrides={"hop_delay_s": 0.1, "hop_loss": 0.1}),
        Variant("hop-0.1-loss-30", "0.1 s and 30 % lost per link", overrides={"hop_delay_s": 0.1, "hop_loss": 0.3}),
        Variant("hop-0.2-loss-30", "0.2 s and 30 % lost per link", overrides={"hop_delay_s": 0.2, "hop_loss": 0.3}),
        Variant("perfect", "Perfect broadcast", overrides={"warning": "broadcast"}),
    ),
    win_tolerance=0.5,
    columns=(
        Column("collided_intact", "episodes with a collision of an intact vehicle", over="share", form="{:.0%}"),
        Column("smallest_gap_m", "smallest gap (m)", over="smallest"),
        Column("return", "cost where nobody attacks", against="none"),
        Column("false_alarms", "corrected in vain, nobody attacks (%)", form="{:.2f}", against="none"),
    ),
    notes=(
        "Played before preset `learning` changed: corrections below 0.05 m/s2 did nothing, larger ones jumped in with "
        "noise, and the attacker's usual opponent was `string`. Do not compare these figures with today's game.",
        "Every vehicle acts on its own sensors, its predecessor's and its record; only `informed` is told more.",
        "Where nobody attacks, the row of `none` is what a defence costs.",
        "A gap below 0 is that of vehicles that passed through one another: collisions do not stop an episode.",
    ),
)
