"""What `cps-envs contest` plays of the rogue-vehicle problem, and who plays in preset `learning`.

The searches of responses know those, too.
"""

from __future__ import annotations

import json
from itertools import product

from cps_baselines.arena import Contestant
from cps_baselines.contest import SELF_PLAY, Column, Constraint, Contest, Search, Side, Variant
from cps_baselines.rogue.contested_search import DEFENDERS as RESPONDED_TO
from cps_envs.rogue.config import LEARNING
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN

RESPONSES = tuple(Contestant(f"contested {against}", f"contested?against={against}") for against in RESPONDED_TO)
ATTACKERS = (
    Contestant("none"),
    Contestant("square"),
    Contestant("slow_square", "square?frequency_hz=0.05"),
    Contestant("duty_square"),
    Contestant("random"),
    Contestant("switching"),
    *RESPONSES,
    Contestant("identify"),
    Contestant("strike"),
    Contestant("brake_strike", "strike?effort=-1"),
)
DEFENDERS = (
    *(
        Contestant(name)
        for name in ("none", "pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")
    ),
    Contestant("assigned"),
    Contestant("ssl", "assigned?laws=ssl"),
    Contestant("front", "assigned?laws=f"),
    Contestant("monitor"),
)


FRONT_CLASSES = ((0, 2), (2, 4), (4, LEARNING.max_vehicles))  # places from the rear that have the same law
RATIOS = (1.0, 1.1, 1.2, 1.3)
OTHER_SPACES = "trained in preset easy, where observations and actions have other sizes"
WEIGHT = (-2.0, 2.0)
FORM = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias")


def constant(laws: tuple[int, ...], modified: int = 0) -> str:
    """The action of one law for each class of places, as a policy."""
    orders = [0] * (2 * LEARNING.max_vehicles)
    for law, (first, end) in zip(laws, FRONT_CLASSES, strict=True):
        orders[2 * first : 2 * end] = [law, modified] * (end - first)
    return f"always?action={json.dumps(orders, separators=(',', ':'))}"


SWITCHING = Search("switching", "tuned", dict.fromkeys(FORM, WEIGHT) | {"hysteresis": (0.0, 1.0)})
RAMMING = Search(
    "strike", "strike", {"strike_s": (0.5, 9.0), "period_s": (10.0, 40.0), "effort": (-1.0, 1.0)}, {"effort": 0.9}
)
BRAKING = Search("brake", "strike", RAMMING.ranges, {"effort": -0.9})
MONITOR = Search(
    "monitor",
    "monitor",
    {
        "margin_mps": (0.3, 3.0),
        "slack_mps2": (0.5, 5.0),
        "threshold_mps": (0.3, 5.0),
        "release_s": (2.0, 40.0),
        "near_m": (0.0, 30.0),
        "near_strong_m": (10.0, 60.0),
        "strong_mps2": (0.2, 1.5),
        "horizon_s": (0.0, 3.0),
    },
)

CONTEST = Contest(
    problem="rogue",
    attackers=Side(
        policies=(*ATTACKERS, Contestant("gains")),
        constants=tuple(f"always?action={share / 10}" for share in range(-10, 11)),
        searches=(SWITCHING, RAMMING, BRAKING),
        margin_neutral=5.0,
        left_out={
            "tuned": "a family for searches; what was found with it is `contested`",
            "probe": "knows the six controllers of preset `paper`; `identify` does the same for this one",
            "beam": "plans every episode anew for seconds, on copies of the world; see docs/rogue.md",
            **dict.fromkeys(("zoo:rogue-attack-ppo", "zoo:rogue-attack-recurrent"), OTHER_SPACES),
            "zoo:rogue-attack-mixture": SELF_PLAY,
        },
    ),
    defenders=Side(
        policies=(*DEFENDERS, Contestant("pd_detection"), Contestant("zoo:rogue-defense-monitor-cma")),
        constants=(
            *(constant(laws) for laws in product(range(len(DRIVEN)), repeat=len(FRONT_CLASSES))),
            *(constant((law,) * 3, 1) for law in range(2, len(CONTROLLERS)) if CONTROLLERS[law] != "human"),
        ),
        informed=(Contestant("informed"),),
        searches=(MONITOR,),
        margin_informed=1.0,
        margin_neutral=0.5,  # the neutral action is the best controller that needs no thought
        left_out={
            "random": "draws every order anew, which is no defence; `cps-envs learnability` plays it",
            **dict.fromkeys(("zoo:rogue-defense-ppo", "zoo:rogue-defense-cma"), OTHER_SPACES),
            "zoo:rogue-defense-mixture": SELF_PLAY,
        },
    ),
    variants=(
        Variant("learning", "Platoons of 4 to 8, ratio 1 to 1.3"),
        *(Variant(f"ratio-{ratio:g}", f"Power ratio {ratio:g}", overrides={"power_ratio": ratio}) for ratio in RATIOS),
    ),
    win_tolerance=1.0,
    columns=(
        Column("damage", "damage, m/s", form="{:.1f}"),
        Column("formation_cost_s", "formation cost, s", form="{:.0f}"),
        Column("collisions", "episodes with a collision", "share"),
        Column("false_alarms", "false alarms, nobody attacks", form="{:.1f}", against="none"),
    ),
    constraint=Constraint(
        harm=Column("damage", "damage, m/s"),
        cost=Column("formation_cost_s", "formation cost, s"),
        reference="sliding",
    ),
    notes=(
        "Played before preset `learning` changed: impacts were paid by their whole speed, places that nobody could "
        "reach were charged, and `none` was the linear controller. Do not compare these figures with today's game.",
        "The attacker is paid the damage, impacts by their speed beyond 2 m/s, and 0.2 m/s for each second of formation"
        " cost. It counts intact vehicles and the places that they can reach.",
        "Read with a constraint: of the defenders whose formation cost is at most that of `sliding`, the one with the "
        "least damage. Means over all attackers; `open` where the interval of the paired difference contains zero.",
        "`informed` is told the seat, the onset and the attacker; its laws against each were searched.",
        "False alarms are those of the vehicles' own detectors that blame an intact neighbour.",
    ),
)
