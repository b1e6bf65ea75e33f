"""What the tests that run over every problem need to know about each: short episodes, lively variants, golden cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from cps_envs.core.types import Role
from cps_paper.fdi.interpretations import INTERPRETATIONS

Settings = Mapping[str, Any]


class Golden(NamedTuple):
    """An episode to be kept: the arguments of the role's environment, its seeds, and how much the actor acts."""

    role: Role
    kwargs: Settings
    seed: int = 0
    boldness: float = 0.5


class ProblemTests(NamedTuple):
    short: Settings  # arguments of a short episode
    variants: Mapping[Role, Sequence[Settings]]  # under which together every observation entry comes alive
    golden: Mapping[str, Golden]


SHORT_DAY = {"num_steps": 130, "window_steps": 100, "onset_step": 90}
PLAYED_DAY = {"preset": "easy", "num_steps": 300, "onset_step": (50, 150)}
FILTERED_DAY = {
    "preset": "learning",
    "num_steps": 300,
    "onset_step": (200, 220),
    "compromised_weights": (0, 0, 0, 0, 1),
}
LOOP_DAY = {
    "preset": "learning",
    "num_steps": 400,
    "onset_step": [200, 220],
    "command_attack_w": 300.0,
    "reference_attack_c": 2.0,
    "denial": ["readings", "commands"],
    "thermostats": True,
}
HVAC_TESTS = ProblemTests(
    short=SHORT_DAY,
    variants={
        "attacker": [
            {**PLAYED_DAY, "opponent": "tests.hvac.players:RandomChoice"},
            {**FILTERED_DAY, "opponent": "tests.hvac.players:RandomChoice"},
        ],
        "defender": [
            {**PLAYED_DAY, "num_compromised": 4, "opponent": "tests.hvac.players:Constant"},
            {**FILTERED_DAY, "opponent": "tests.hvac.players:Constant"},
        ],
    },
    golden={
        "paper attack": Golden("attacker", {"preset": "paper", "opponent": "none"}),
        "paper defence": Golden("defender", {"preset": "paper", "opponent": "none"}, seed=1),
        "constant attack": Golden(
            "defender", {"preset": "paper", "opponent": "tests.hvac.players:Constant"}, seed=2, boldness=1.0
        ),
        "eight sensors": Golden(
            "defender", {"preset": "paper", "num_sensors": 8, "opponent": "tests.hvac.players:Constant"}, seed=3
        ),
        "easy attack": Golden("attacker", {"preset": "easy", "opponent": "none"}, seed=4),
        "easy defence": Golden(
            "defender", {"preset": "easy", "opponent": "tests.hvac.players:Constant"}, seed=5, boldness=1.0
        ),
        "learning attack": Golden("attacker", {"preset": "learning", "opponent": "none"}, seed=7),
        "learning defence": Golden(
            "defender", {"preset": "learning", "opponent": "tests.hvac.players:Constant"}, seed=8, boldness=1.0
        ),
        "hard defence": Golden("defender", {"preset": "hard", "opponent": "tests.hvac.players:Constant"}, seed=9),
        "weather attack": Golden("attacker", {"preset": "weather", "opponent": "none"}, seed=15),
        "weather defence": Golden(
            "defender", {"preset": "weather", "opponent": "tests.hvac.players:Constant"}, seed=16
        ),
        "limits in the program": Golden(
            "defender",
            {"preset": "paper", "controller": "qp", "num_steps": 300, "opponent": "tests.hvac.players:Constant"},
            seed=10,
        ),
        "from level to level": Golden(
            "defender",
            {"preset": "paper", "controller": "levels", "num_steps": 300, "opponent": "tests.hvac.players:Constant"},
            seed=11,
        ),
        "thermostats for a controller": Golden(
            "defender", {"preset": "paper", "controller": "on_off", "opponent": "tests.hvac.players:Constant"}, seed=12
        ),
        "commands, set-points and messages": Golden(
            "attacker", {**LOOP_DAY, "opponent": "tests.hvac.players:RandomChoice"}, seed=13, boldness=1.0
        ),
        "thermostats on the spot": Golden("defender", {**LOOP_DAY, "opponent": "push"}, seed=14, boldness=1.0),
        "grey box": Golden(
            "attacker",
            {
                "preset": "paper",
                "attacker_view": "grey",
                "attack_action": "bias",
                "num_sensors": 8,
                "opponent": "tests.hvac.players:MovingTarget",
            },
            seed=6,
        ),
    },
)
EVERY_SENSOR = "x1,2,3,4+v1,2,3,4+rx2,3,4+rv2,3,4>1 v1>2 x1>1"
FDI_DUEL = {"preset": "learning", "tasks": EVERY_SENSOR, "attack_share": 1.0, "onset_s": 0.3}
ROGUE_DRAWN = {"preset": "easy", "duration_s": 30.0, "attacker_index": [1, 4]}
ROGUE_HIDDEN = {"preset": "learning", "duration_s": 30.0, "onset_s": [0.0, 15.0]}
SQUARE = "square?frequency_hz=0.12"
LONG_CONTEST = {
    "preset": "learning",
    "duration_s": 120.0,
    "control_period_s": 0.5,
    "quiet_share": 0.0,
    "earliest_attack_s": (1, 5),
    "attack_pause_s": 0,
    "attack_budget": 10,
}
LONG_EASY = {"preset": "easy", "duration_s": 120.0}
PROBLEM_TESTS: Mapping[str, ProblemTests] = {
    "disbanding": ProblemTests(
        short={"duration_s": 4.0},
        variants={
            "attacker": [LONG_EASY, LONG_CONTEST],
            "defender": [
                {**LONG_EASY, "attack_budget": 6, "control_period_s": 0.5},
                {**LONG_CONTEST, "opponent": "random"},
            ],
        },
        golden={
            "paper attack": Golden("attacker", {"preset": "paper"}),
            "paper defence": Golden("defender", {"preset": "paper", "opponent": "lead"}, boldness=0.0),
            "paper defence, random corrections": Golden("defender", {"preset": "paper", "duration_s": 60.0}, seed=1),
            "easy attack": Golden("attacker", {"preset": "easy"}, seed=2),
            "easy defence": Golden("defender", {"preset": "easy", "duration_s": 60.0}, seed=3),
            "learning attack": Golden("attacker", {"preset": "learning", "opponent": "feedback"}, seed=7),
            "learning defence": Golden(
                "defender", {"preset": "learning", "duration_s": 60.0, "opponent": "spread"}, seed=12
            ),
            "members, perfect warning": Golden(
                "defender",
                {
                    "preset": "learning",
                    "duration_s": 40.0,
                    "opponent": "lead",
                    "warning": "broadcast",
                    "quiet_share": 0.0,
                    "earliest_attack_s": 1,
                    "member_delay_s": 0.1,
                    "attacked_member": [1, 10],
                },
                seed=9,
            ),
            "one vehicle attack": Golden("attacker", {"preset": "one_vehicle"}, seed=10),
            "one vehicle defence": Golden(
                "defender", {"preset": "one_vehicle", "duration_s": 60.0, "opponent": "lead"}, seed=11
            ),
            "rules of the text, half the step": Golden(
                "defender",
                {
                    "preset": "paper",
                    "duration_s": 40.0,
                    "tau_s": 0.5,
                    "opponent": "lead",
                    "dt_s": 0.005,
                    "standstill_rule": True,
                    "transitional_controller": True,
                },
                seed=12,
                boldness=0.1,
            ),
            "drivers attack": Golden("attacker", {"preset": "drivers", "opponent": "string"}, seed=13),
            "drivers defence": Golden(
                "defender", {"preset": "drivers", "duration_s": 60.0, "opponent": "shake"}, seed=14, boldness=0.2
            ),
            "S1": Golden("attacker", {"preset": "paper", "interpretation": "S1"}, seed=4),
            "S2": Golden("attacker", {"preset": "paper", "interpretation": "S2"}, seed=5),
            "fewer platoons": Golden("attacker", {"preset": "easy", "num_platoons": [6, 10]}, seed=6),
        },
    ),
    "fdi": ProblemTests(
        short={"horizon": 40},
        variants={
            "attacker": [{"preset": "easy"}, {**FDI_DUEL, "opponent": "chi2?gate=0.3"}],
            "defender": [{"preset": "defense"}, {"preset": "defense", "opponent": "random"}, FDI_DUEL],
        },
        golden={
            "paper attack": Golden("attacker", {"preset": "paper"}, boldness=1.0),
            "paper defence": Golden("defender", {"preset": "paper", "opponent": "bang_bang"}, boldness=0.0),
            "set B": Golden(
                "attacker",
                {"preset": "paper", **INTERPRETATIONS["B"], "attacked": "v1,4", "target": 1},
                seed=1,
                boldness=1.0,
            ),
            "listed tasks": Golden("attacker", {"preset": "paper", "tasks": "x1>1 v4>4"}, seed=5, boldness=1.0),
            "five vehicles": Golden("attacker", {"preset": "easy", "num_vehicles": 5}, seed=9, boldness=1.0),
            "instability attack": Golden(
                "attacker", {"preset": "paper", **INTERPRETATIONS["instability"]}, seed=10, boldness=1.0
            ),
            "instability defence": Golden(
                "defender",
                {"preset": "paper", **INTERPRETATIONS["instability"], "horizon": 300, "opponent": "bnb"},
                seed=11,
            ),
            "figure 3.2": Golden(
                "defender",
                {"preset": "paper", **INTERPRETATIONS["fig32"], "horizon": 640, "opponent": "bnb"},
                boldness=0.0,
            ),
            "learning attack": Golden("attacker", {"preset": "learning", "opponent": "none"}, seed=7, boldness=1.0),
            "learning defence": Golden("defender", {"preset": "learning", "opponent": "random"}, seed=8),
            "disturbed defence": Golden(
                "defender", {"preset": "defense", "tasks": "x4>4 xv1>1", "opponent": "random"}, seed=6
            ),
        },
    ),
    "hvac": HVAC_TESTS,
    "rogue": ProblemTests(
        short={"duration_s": 4.0},
        variants={"attacker": [ROGUE_DRAWN, ROGUE_HIDDEN], "defender": [ROGUE_DRAWN, ROGUE_HIDDEN]},
        golden={
            "paper attack": Golden("attacker", {"preset": "paper", "opponent": "none"}),
            "paper attack on detection": Golden(
                "attacker", {"preset": "paper", "opponent": "sliding_detection", "power_ratio": 1.3}, seed=1
            ),
            "paper defence": Golden("defender", {"preset": "paper", "opponent": SQUARE}, boldness=0.0),
            "paper defence, random laws": Golden("defender", {"preset": "paper", "opponent": SQUARE}, seed=2),
            "paper defence, commands": Golden(
                "defender",
                {"preset": "paper", "opponent": SQUARE, "defense_action": "command", "duration_s": 60.0},
                seed=3,
            ),
            "easy attack": Golden("attacker", {"preset": "easy", "opponent": "sliding"}, seed=4),
            "easy defence": Golden("defender", {"preset": "easy", "opponent": SQUARE}, seed=5),
            "oscillation attack": Golden("attacker", {"preset": "oscillation", "opponent": "pd"}, seed=9),
            "oscillation defence": Golden("defender", {"preset": "oscillation", "opponent": "gains"}, boldness=0.0),
            "seats attack": Golden("attacker", {"preset": "seats", "opponent": "pd_detection"}, seed=10),
            "seats defence": Golden("defender", {"preset": "seats", "opponent": SQUARE}, seed=11),
            "learning attack": Golden("attacker", {"preset": "learning", "opponent": "sliding_detection"}, seed=7),
            "learning defence": Golden("defender", {"preset": "learning", "opponent": SQUARE}, seed=8),
            "city attack": Golden("attacker", {"preset": "city", "opponent": "sliding_detection"}, seed=12),
            "trucks in the city": Golden(
                "defender",
                {"preset": "city", "opponent": SQUARE, "drive_mps2": [5, [4, 5], 5, 5, 4, 5, 5, 5]},
                seed=13,
            ),
            "two attackers": Golden(
                "attacker",
                {"preset": "learning", "opponent": "sliding_detection", "num_vehicles": 5, "attacker_indices": [2, 4]},
                seed=14,
            ),
            "defence against two attackers": Golden(
                "defender",
                {
                    "preset": "easy",
                    "opponent": "square?frequency_hz=0.12&shift=0.5",
                    "attacker_indices": [2, 4],
                    "duration_s": 30.0,
                },
                seed=15,
            ),
            "the leader seized": Golden(
                "attacker", {"preset": "easy", "opponent": "pd", "attacker_index": 5, "power_ratio": 2.0}, seed=16
            ),
            "any vehicle seized": Golden(
                "defender", {"preset": "learning", "opponent": SQUARE, "attacker_index": [1, 8]}, seed=17
            ),
            "long platoon": Golden(
                "attacker",
                {"preset": "easy", "opponent": "none", "num_vehicles": 10, "attacker_index": [2, 9]},
                seed=6,
            ),
        },
    ),
}


def tests_of(name: str) -> ProblemTests:
    """The settings of a problem; empty ones for a problem that has not been described here."""
    return PROBLEM_TESTS.get(name, ProblemTests({}, {}, {}))
