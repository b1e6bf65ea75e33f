"""The configuration of the disbanding problem and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from cps_envs.core.declare.bodies import names_each
from cps_envs.core.declare.config import (
    IntRange,
    Range,
    RangedBodies,
    bounds,
    check_bodies,
    is_multiple,
    quantity,
    validate,
)
from cps_envs.core.declare.objective import Payoff, objective
from cps_envs.core.errors import ConfigurationError

TABLE = "Table 2.1"
SHORTEST_STEP_S = 5e-4
ROAD = (  # what numbers of policies were found for, too
    *("vehicles_per_platoon", "desired_gap_m", "headway_s", "desired_speed_mps", "max_speed_mps"),
    *("min_acceleration_mps2", "max_acceleration_mps2"),
)
OF_VEHICLES = ("tau_s", "proportional_gain", "derivative_gain")


@dataclass(frozen=True)
class Interpretation:
    """What a simulation of chapter 2 must assume although the paper does not print it.

    The step is part of the model: crash flags of Table 2.2 flip between 0.01 s and 0.02 s. A configuration may set
    another step, and add the transitional controller and the standstill rule. The flags have the names and meanings of
    the fields of `state.Constants`.
    """

    dt_s: float  # integration step; inferred, only 0.01 to 0.02 s fits the paper's numbers
    exact_integration: bool = False  # zero-order hold of (2.1) instead of explicit Euler
    saturate_command: bool = False  # clip every command to [u_min, u_max]; without it the command leads the lag
    one_sided_avoidance: bool = False  # (2.6) with max(0, v^2 - v_p^2)
    transitional_controller: bool = False  # leaders that close in brake before they reach h v
    inelastic_contact: bool = False  # vehicles that touch stay behind one another instead of passing as ghosts
    standstill_rule: bool = False  # who is nearer than r_0 to the vehicle ahead cannot move


INTERPRETATIONS = {
    # The plain reading; the default.
    "S0": Interpretation(dt_s=0.01),
    # All six crash flags of the baseline of Table 2.2 are right.
    "S1": Interpretation(dt_s=0.02, transitional_controller=True),
    # All six E_v of the baseline of Table 2.2 are within two points.
    "S2": Interpretation(
        dt_s=0.05, exact_integration=True, saturate_command=True, one_sided_avoidance=True, inelastic_contact=True
    ),
}


@cache
def interpreted(name: str, dt_s: float, transitional_controller: bool, standstill_rule: bool) -> Interpretation:
    """An interpretation with a step of its own (0: none) and the rules that a configuration adds to it."""
    base = INTERPRETATIONS[name]
    return replace(
        base,
        dt_s=dt_s or base.dt_s,
        transitional_controller=transitional_controller or base.transitional_controller,
        standstill_rule=standstill_rule or base.standstill_rule,
    )


@dataclass(frozen=True)
class DisbandingConfig:
    """N platoons of n vehicles in one lane, an attacker who disbands platoons, a defender who corrects commands.

    A field marked as ranged takes a number, or a pair (low, high) from which every reset draws uniformly. The lag and
    the gains also take a tuple with a value for each vehicle of the longest string, from the front.

    Raises:
        ConfigurationError: a value of wrong type, out of bounds, or that does not fit the others.
    """

    num_platoons: IntRange = quantity(10, low=2, high=10_000, source=f"{TABLE}: 2..10", ranged=True)
    vehicles_per_platoon: int = quantity(10, low=2, high=50, source=TABLE)
    duration_s: float = quantity(180.0, unit="s", low=1, high=86_400, source=f"{TABLE}: T_s")
    tau_s: RangedBodies = quantity(
        0.1, unit="s", low=0.01, high=2, source=f"{TABLE}: 0.1, 0.3, 0.5", ranged=True, bodies="vehicle"
    )
    desired_gap_m: Range = quantity(5.0, unit="m", low=1, high=100, source=f"{TABLE}: x_d = 5 or 4", ranged=True)
    headway_s: float = quantity(1.5, unit="s", low=0.1, high=10, source=f"{TABLE}: h")
    proportional_gain: RangedBodies = quantity(
        1.0, unit="1/s2", low=0, high=100, source=f"{TABLE}: k_p", ranged=True, bodies="vehicle"
    )
    derivative_gain: RangedBodies = quantity(
        5.0, unit="1/s", low=0, high=100, source=f"{TABLE}: k_d", ranged=True, bodies="vehicle"
    )
    desired_speed_mps: float = quantity(31.0, unit="m/s", low=1, high=100, source=f"{TABLE}: v_d")
    max_speed_mps: float = quantity(36.0, unit="m/s", low=1, high=100, source=f"{TABLE}: v_max; v_min is 0")
    min_acceleration_mps2: float = quantity(-5.0, unit="m/s2", low=-20, high=-0.1, source=f"{TABLE}: u_min")
    max_acceleration_mps2: float = quantity(1.0, unit="m/s2", low=0.1, high=20, source=f"{TABLE}: u_max")
    standstill_gap_m: float = quantity(1.0, unit="m", low=0, high=20, source=f"{TABLE}: r_0")
    interpretation: str = quantity("S0", choices=tuple(INTERPRETATIONS), source="inferred; the paper prints none")
    dt_s: float = quantity(0.0, unit="s", low=0, high=0.1, source="chosen: integration step; 0: the interpretation's")
    transitional_controller: bool = quantity(False, source="2.2.1: leaders brake early; S1 has it in any case")
    standstill_rule: bool = quantity(False, source="after (2.5): nobody moves whose gap is below r_0")
    control_period_s: float = quantity(
        0.1, unit="s", low=0.01, high=1, source="chosen: the defender's decision", form=("defender",)
    )
    attack_budget: IntRange = quantity(2, low=1, high=50, source="Table 2.3 disbands two platoons", ranged=True)
    gap_spread: float = quantity(0.0, low=0, high=0.5, source="chosen: initial gaps +- this share")
    speed_spread_mps: float = quantity(0.0, unit="m/s", low=0, high=5, source="chosen: initial speeds +- this")
    takeover_delay_s: Range = quantity(0.0, unit="s", low=0, high=10, source="chosen: per driver", ranged=True)
    driver_headway_s: Range = quantity(1.5, unit="s", low=0.1, high=10, source=f"{TABLE}: h, per driver", ranged=True)
    collision_penalty: float = quantity(0.0, unit="points of E_v", low=0, high=100, source="chosen: per 100/M vehicles")
    on_collision: str = quantity("continue", choices=("continue", "end"), source="chosen: ghosts go on, or the end")
    payoff: Payoff = objective({"velocity_error": {}}, source="(2.8), see `payoff_set`, and penalties; others chosen")
    payoff_set: str = quantity("all", choices=("all", "intact_now"), source="chosen: whose speed errors count")
    defense_action: str = quantity(
        "vehicle", choices=("vehicle", "platoon"), source="chosen: one correction for each", form=("defender",)
    )
    swarm_reward: str = quantity("team", choices=("team", "local"), source="chosen: of the swarm form")
    warning: str = quantity("broadcast", choices=("broadcast", "relayed"), source="2.4.2: by V2V, at a low data rate")
    hop_delay_s: Range = quantity(0.1, unit="s", low=0.01, high=2, source="chosen: per link", ranged=True)
    hop_loss: Range = quantity(0.0, low=0, high=0.95, source="chosen: share of messages lost per link", ranged=True)
    correctable: str = quantity("upstream", choices=("upstream", "intact"), source="chosen: who reacts to corrections")
    quiet_share: float = quantity(0.0, low=0, high=1, source="chosen: share of the episodes without an attack")
    earliest_attack_s: IntRange = quantity(1, unit="s", low=1, high=86_400, source="(2.9): t_d >= 1 s", ranged=True)
    attack_pause_s: int = quantity(0, unit="s", low=0, high=86_400, source="chosen: between two attacks, at least")
    jam_budget_s: IntRange = quantity(0, unit="s", low=0, high=600, source="chosen; 2.1 jams sensors only", ranged=True)
    member_delay_s: float = quantity(0.0, unit="s", low=0, high=10, source="2.2.2: a platoon is alerted by V2V")
    attacked_member: IntRange = quantity(1, low=1, high=50, source="2.2.2; 1 = the platoon's leader", ranged=True)
    braking_share: float = quantity(0.0, low=0, high=1, source="2.1: some drivers brake when they take over")
    braking_mps2: Range = quantity(5.0, unit="m/s2", low=0, high=20, source="2.1: maximum deceleration", ranged=True)
    braking_s: Range = quantity(1.0, unit="s", low=0, high=10, source="chosen: per driver", ranged=True)
    correction_noise_mps2: float = quantity(0.0, unit="m/s2", low=0, high=5, source="chosen: s.d., from actuators")
    full_correction_mps2: float = quantity(
        0.0, unit="m/s2", low=0, high=10, source="chosen: the rule grows up to it; 0: it jumps in at 0.05 m/s2"
    )
    attack: str = quantity("message", choices=("message", "jolt"), source="2.1.2: an alarm, or irregular motion")
    jolt_mps2: float = quantity(2.0, unit="m/s2", low=0.1, high=20, source="chosen: how hard a jolted vehicle brakes")
    jolt_s: float = quantity(1.0, unit="s", low=0.1, high=10, source="chosen: for how long")
    alarming_braking_mps2: Range = quantity(
        0.0, unit="m/s2", low=0, high=20, source="1.5: drivers take over beyond it; 0: none does", ranged=True
    )
    alarming_jerk_mps3: Range = quantity(
        0.0, unit="m/s3", low=0, high=1000, source="1.5: drivers take over beyond it; 0: none does", ranged=True
    )
    alarming_gap_m: Range = quantity(
        0.0, unit="m", low=0, high=20, source="1.5: drivers take over below it; 0: none does", ranged=True
    )
    reaction_s: Range = quantity(0.0, unit="s", low=0, high=10, source="chosen: per driver, until then", ranged=True)
    report: str = quantity(
        "chapter", choices=("chapter", "safety", "full"), source="chosen: metrics of chapter 2, or more"
    )

    def __post_init__(self) -> None:
        validate(self)
        check_bodies(self, {"vehicle": self.max_vehicles})
        dt_s = self.dynamics.dt_s
        if dt_s < SHORTEST_STEP_S:
            raise ConfigurationError(
                f"dt_s = {self.dt_s} is shorter than {SHORTEST_STEP_S} s. Choose 0 for the interpretation's own step."
            )
        for name, whole, part in (
            ("control_period_s", self.control_period_s, dt_s),
            ("control_period_s", 1.0, self.control_period_s),
            ("duration_s", self.duration_s, 1.0),
        ):
            if not is_multiple(whole, part):
                raise ConfigurationError(
                    f"{name} = {getattr(self, name)}: the integration step {dt_s} s must divide the control period, "
                    "the control period 1 s, and 1 s the duration. Choose for example control_period_s=0.1."
                )
        if self.attack == "message" and bounds(self.attack_budget)[1] > bounds(self.num_platoons)[0]:
            raise ConfigurationError(
                f"attack_budget = {self.attack_budget} exceeds the number of platoons, num_platoons = "
                f"{self.num_platoons}: a platoon can be disbanded only once."
            )
        self._check_drivers()
        if dt_s > bounds(self.tau_s)[0] and not self.dynamics.exact_integration:
            raise ConfigurationError(
                f"tau_s = {self.tau_s} is shorter than the integration step {dt_s} s of {self.interpretation}, which "
                "explicit Euler cannot follow. Choose a longer tau_s, a shorter dt_s, or "
                'interpretation="S2", which integrates exactly.'
            )
        closest_m = bounds(self.desired_gap_m)[0] * (1.0 - self.gap_spread)
        if self.standstill_rule and closest_m <= self.standstill_gap_m:
            raise ConfigurationError(
                f"standstill_rule = True: nobody could move at the start, where gaps are {closest_m:g} m and "
                f"standstill_gap_m = {self.standstill_gap_m}. Choose a larger desired_gap_m or a smaller gap_spread."
            )
        if bounds(self.attacked_member)[1] > self.vehicles_per_platoon:
            raise ConfigurationError(
                f"attacked_member = {self.attacked_member} exceeds vehicles_per_platoon = {self.vehicles_per_platoon}. "
                "Choose 1 for the leader."
            )
        if self.desired_speed_mps > self.max_speed_mps:
            raise ConfigurationError(
                f"desired_speed_mps = {self.desired_speed_mps} exceeds max_speed_mps = {self.max_speed_mps}."
            )

    def _check_drivers(self) -> None:
        if self.attack == "jolt" and not self.watchful:
            raise ConfigurationError(
                'attack = "jolt" makes no driver take over, since none is alarmed by anything: give '
                "alarming_braking_mps2, alarming_jerk_mps3 or alarming_gap_m, or take preset drivers."
            )
        if self.watchful and self.member_delay_s > 0:
            raise ConfigurationError(
                f"member_delay_s = {self.member_delay_s} lets an alert spread from the attacked vehicle, but drivers "
                "who watch begin anywhere in a platoon: give takeover_delay_s for them."
            )
        closest_m = bounds(self.desired_gap_m)[0] * (1.0 - self.gap_spread)
        if bounds(self.alarming_gap_m)[1] >= closest_m:
            raise ConfigurationError(
                f"alarming_gap_m = {self.alarming_gap_m}: gaps are {closest_m:g} m at the start, and drivers would "
                "take over at once. Choose a smaller one, or a larger desired_gap_m."
            )

    @property
    def watchful(self) -> bool:
        """Whether some drivers take over because of what they see."""
        limits = (self.alarming_braking_mps2, self.alarming_jerk_mps3, self.alarming_gap_m)
        return any(bounds(limit)[1] > 0 for limit in limits)

    @property
    def dynamics(self) -> Interpretation:
        """Integration step and the rules that the paper leaves open."""
        return interpreted(self.interpretation, self.dt_s, self.transitional_controller, self.standstill_rule)

    @property
    def max_platoons(self) -> int:
        """N of the arrays: the most platoons that a reset can draw."""
        return int(bounds(self.num_platoons)[1])

    @property
    def max_budget(self) -> int:
        """The most platoons that the attacker may disband in any episode."""
        return int(bounds(self.attack_budget)[1])

    @property
    def can_jam(self) -> bool:
        """Whether the attacker may block a radio link in any episode."""
        return bounds(self.jam_budget_s)[1] > 0

    @property
    def num_attacks(self) -> int:
        """Actions of the attacker: wait, disband one of N platoons, or block one of the N - 1 links between them."""
        return self.max_platoons * (2 if self.can_jam else 1) + (0 if self.can_jam else 1)

    @property
    def is_relayed(self) -> bool:
        """Whether the warning travels from vehicle to vehicle."""
        return self.warning == "relayed"

    @property
    def max_vehicles(self) -> int:
        """M of the arrays."""
        return self.max_platoons * self.vehicles_per_platoon

    @property
    def differ(self) -> bool:
        """Whether vehicles have a lag or gains of their own."""
        return any(names_each(getattr(self, name)) for name in OF_VEHICLES)

    @property
    def steps_per_period(self) -> int:
        """Integration steps in a control period."""
        return round(self.control_period_s / self.dynamics.dt_s)

    @property
    def periods_per_second(self) -> int:
        """Control periods between two decisions of the attacker, who decides at whole seconds."""
        return round(1.0 / self.control_period_s)

    @property
    def horizon_steps(self) -> int:
        """Integration steps in an episode, K_s of (2.8)."""
        return round(self.duration_s / self.dynamics.dt_s)


PAPER = DisbandingConfig()
EASY = replace(
    PAPER,
    tau_s=(0.1, 0.5),
    desired_gap_m=(4.0, 6.0),
    gap_spread=0.03,
    speed_spread_mps=0.3,
    takeover_delay_s=(0.0, 2.0),
    driver_headway_s=(1.2, 1.8),
    attack_budget=(1, 3),
    collision_penalty=0.3,
)
LEARNING = replace(
    EASY,
    warning="relayed",
    hop_delay_s=(0.05, 0.15),
    hop_loss=(0.0, 0.3),
    correctable="intact",
    quiet_share=0.25,
    earliest_attack_s=(1, 60),
    attack_pause_s=5,
    jam_budget_s=(5, 10),
    braking_share=0.3,
    braking_mps2=(2.0, 5.0),
    braking_s=(0.5, 1.5),
    swarm_reward="local",
    correction_noise_mps2=0.5,
    full_correction_mps2=1.0,  # chosen: noise of 0.1 m/s2 then costs 0.2 points; where it jumps in, 2.6
    report="safety",
)
ONE_VEHICLE = replace(
    PAPER,
    member_delay_s=0.1,
    attacked_member=(1, 10),
    braking_share=0.3,
    braking_mps2=(2.0, 5.0),
    braking_s=(0.5, 1.5),
    report="full",
)
DRIVERS = replace(  # 1.5: passengers assume command after observing irregular motion, and nobody sends a message
    EASY,
    gap_spread=0.01,
    speed_spread_mps=0.1,  # nobody takes over because of the start
    attack="jolt",
    attack_budget=(5, 10),
    alarming_braking_mps2=(2.5, 4.5),
    alarming_jerk_mps3=(30.0, 60.0),
    alarming_gap_m=(1.0, 2.5),
    reaction_s=(0.5, 1.5),
    correctable="intact",
    report="safety",
)
PRESETS = {"paper": PAPER, "one_vehicle": ONE_VEHICLE, "drivers": DRIVERS, "easy": EASY, "learning": LEARNING}
