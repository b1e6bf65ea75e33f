"""The quantities of the HVAC problem: value, unit, bounds and source of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

from cps_envs.core.declare.config import Bodies, IntRange, OverTime, Range, bounds, extremes, quantity
from cps_envs.core.declare.objective import Payoff, objective
from cps_envs.core.declare.places import SPLITS
from cps_envs.core.types import ROLES

DAY_S = 86_400.0
MAX_ZONES = 64
MAX_SENSORS = 128  # two in each zone
CALIBRATED = "calibrated, not in the paper"
MEAN_CAPACITY_J_PER_K = 0.54e6  # of the paper's zones, for which ...
MOVE_WEIGHT = 0.25  # C2/W2, ... this was calibrated
LEAST_WEIGHT = 1e-9


@dataclass(frozen=True)
class Parameters:
    """What a configuration of the HVAC problem consists of, unchecked: see `config.HvacConfig`."""

    step_s: float = quantity(120.0, unit="s", low=1, high=3600, source="paper: 1/120 Hz")
    num_steps: int = quantity(720, low=2, high=20_160, source="paper: 24 h; states x(0)..x(719), k = 0 is midnight")
    heat_capacity_j_per_k: tuple[float, ...] = quantity(
        (0.52e6, 0.74e6, 0.35e6, 0.55e6), unit="J/K", low=1e3, high=1e12, source=f"{CALIBRATED}; C1..C4"
    )
    wall_resistance_k_per_w: tuple[float, ...] = quantity(
        (0.42, 0.10, 0.12, 0.15), unit="K/W", low=1e-6, high=1e6, source=f"{CALIBRATED}; R1..R4"
    )
    link_zones: tuple[int, ...] = quantity(
        (1, 2, 1, 3, 2, 4, 3, 4), low=1, high=MAX_ZONES, source="paper: pairs of linked zones, one after the other"
    )
    link_resistance_k_per_w: tuple[float, ...] = quantity(
        (0.016, 0.012, 0.017, 0.047), unit="K/W", low=1e-6, high=1e6, source=f"{CALIBRATED}; R12, R13, R24, R34"
    )
    ground_zones: tuple[int, ...] = quantity((1, 2), low=1, high=MAX_ZONES, source="paper: the others face the outside")
    ground_c: OverTime = quantity(
        23.5, unit="C", low=-40, high=60, series="linear", source=f"{CALIBRATED}; v1, v2; or a series"
    )
    outdoor_c: OverTime = quantity(
        (), unit="C", low=-60, high=60, series="linear", source="own outside, a number or a series; none: as below"
    )
    outdoor_mean_c: float = quantity(23.0, unit="C", low=-40, high=60, source=f"{CALIBRATED}; v3, v4")
    outdoor_swing_c: float = quantity(11.0, unit="C", low=0, high=40, source=f"{CALIBRATED}; amplitude over 24 h")
    internal_heat_w: OverTime = quantity(
        0.0,
        unit="W",
        low=-1e6,
        high=1e6,
        bodies="zone",
        series="hold",
        source="paper: none; heat of people, machines and sun that the controller knows of",
    )
    reference_c: OverTime = quantity(
        25.0, unit="C", low=-40, high=60, bodies="zone", series="hold", source="paper: x_r, the set-point"
    )
    initial_c: float = quantity(24.0, unit="C", low=-40, high=60, source=f"{CALIBRATED}; x(0) of every zone")
    max_heating_w: Bodies = quantity(
        1000.0, unit="W", low=1, high=1e9, bodies="zone", source="paper: E; Fig. 4.3 also 500, 100"
    )
    min_heating_w: Bodies = quantity(
        0.0, unit="W", low=-1e9, high=0, bodies="zone", source="paper: 0; below it the plant cools"
    )
    num_levels: int = quantity(
        100, low=1, high=1_000_000, source="chosen: the paper has levels in % of E, not which; Fig. 4.3 shows 1 %"
    )
    prediction_steps: int = quantity(80, low=1, high=200, source=f"{CALIBRATED}; N")
    move_weight: float = quantity(
        MOVE_WEIGHT,
        unit="C2/W2",
        low=LEAST_WEIGHT,
        high=1e9,
        source=f"{CALIBRATED}; R = 0.25 I, Q = I; scaled for other heat capacities",
    )
    controller: str = quantity(
        "clip",
        choices=("clip", "qp", "levels", "on_off"),
        source="chosen: (4.17) without limits, then clipped; with 0 <= u <= E; the same, from level to level; or the "
        "thermostats that 1.2.1 compares with",
    )
    hysteresis_c: float = quantity(
        0.5, unit="C", low=0, high=40, source="chosen: thermostats switch at this distance from the set-point"
    )
    num_sensors: int = quantity(4, low=1, high=MAX_SENSORS, source="paper: 4 or 8; one or two per zone")
    noise_std_c: Bodies = quantity(sqrt(0.2), unit="C", low=0, high=10, bodies="sensor", source=f"{CALIBRATED}; sigma")
    sensor_low_c: Bodies = quantity(
        10.0, unit="C", low=-60, high=100, bodies="sensor", source="chosen: range of forged readings"
    )
    sensor_high_c: Bodies = quantity(
        40.0, unit="C", low=-60, high=100, bodies="sensor", source="chosen: range of forged readings"
    )
    window_steps: int = quantity(200, low=1, high=2000, source="paper: N_e; Fig. 4.5 also 100, 30")
    sensor_sets: tuple[int, ...] = quantity(
        (), low=0, high=MAX_SENSORS, source="own sets of sensors, 0 between two sets; none: by set_size"
    )
    set_size: int = quantity(
        0, low=0, high=MAX_SENSORS, source="sets of so many sensors in a row, one from each; 0: all of (4.31)"
    )
    thresholds_c2: tuple[float, ...] = quantity(
        (0.418, 0.425),
        unit="C2",
        low=1e-9,
        high=1e9,
        source="calibrated: eps of MTD2, with one and with two sensors per zone",
    )
    onset_step: IntRange = quantity(200, low=0, high=20_160, source="defined: t_0, first forged reading", ranged=True)
    num_compromised: IntRange = quantity(
        2, low=1, high=MAX_SENSORS, source="paper: 1 to all", ranged=True, instead_of="compromised_weights"
    )
    attack_order: tuple[int, ...] = quantity(
        (), low=1, high=MAX_SENSORS, source="sensors in the order in which they fall; none: 2, 1, 4, 3, 6, 5, 8, 7"
    )
    compromised_weights: tuple[float, ...] = quantity(
        (),
        low=0,
        high=1e6,
        source="chosen: weights of 0, 1, ... compromised sensors; none: by num_compromised",
    )
    random_compromise: bool = quantity(False, source="chosen: compromised sensors drawn from the order, not its prefix")
    model_error: float = quantity(0.0, low=0, high=0.3, source="(4.30): entries of A_c off by up to this share")
    unmeasured_heat_w: float = quantity(0.0, unit="W", low=0, high=1e6, source="chosen: unknown heat, +- this per zone")
    heat_drift_w: Range = quantity(
        0.0, unit="W", low=0, high=1e6, source="chosen: std of drifting heat, drawn for each zone", ranged=True
    )
    drift_h: float = quantity(4.0, unit="h", low=0.01, high=1e4, source="chosen: memory of the slow half of the drift")
    drift_hold_h: float = quantity(
        3.0, unit="h", low=0.01, high=1e4, source="chosen: mean time between steps of the other half, as people come"
    )
    forecast_bias_c: Range = quantity(
        0.0, unit="C", low=0, high=20, source="chosen: std of outside minus forecast, the same all day", ranged=True
    )
    forecast_drift_c: Range = quantity(
        0.0, unit="C", low=0, high=20, source="chosen: std of what comes to it over the day", ranged=True
    )
    forecast_drift_h: float = quantity(
        4.0, unit="h", low=0.01, high=1e4, source="chosen: memory of the forecast's drift"
    )
    kalman_filters: bool = quantity(
        False, source="chosen: offers a Kalman filter for each set, all and no sensors", form=ROLES
    )
    filter_heat_w: float = quantity(
        100.0, unit="W", low=1e-3, high=1e6, source="chosen: std of drifting heat that these filters expect"
    )
    filter_memory_h: float = quantity(
        4.0, unit="h", low=0.01, high=1e4, source="chosen: memory of the heat that these filters expect"
    )
    thermostats: bool = quantity(
        False,
        source="chosen: the defender can hand the heating to thermostats on the spot, which hear no set-points and no "
        "commands from elsewhere",
        form=ROLES,
    )
    payoff: Payoff = objective(
        {"impact": {}, "discomfort": {"discomfort_h": 1.0}, "energy": {"attack_kwh": 1.0}},
        source="chosen: the attacker's objective, A_impact (4.19), hours of zones out of comfort, or heating",
    )
    comfort_c: float = quantity(
        1.0,
        unit="C",
        low=0,
        high=40,
        source="chosen: out of comfort is further from x_r; 4.3.1 keeps errors around 1 C",
    )
    attack_action: str = quantity(
        "any", choices=("any", "bias"), source="chosen: forge anything, or a bias only", form=("attacker",)
    )
    command_attack_w: Bodies = quantity(
        0.0,
        unit="W",
        low=0,
        high=1e9,
        bodies="zone",
        source="chosen: most that the attacker adds to a heating command, either way; 0: none (1.2.2, Fig. 1.1)",
        form=("attacker",),
    )
    reference_attack_c: Bodies = quantity(
        0.0,
        unit="C",
        low=0,
        high=40,
        bodies="zone",
        source="chosen: most by which the attacker shifts a set-point, either way; 0: none (1.2.2, Fig. 1.1)",
        form=("attacker",),
    )
    denial: tuple[str, ...] = quantity(
        (),
        choices=("readings", "commands"),
        source="chosen: messages that the attacker can keep from arriving; the last values are held (1.3.1, 4.1.1)",
        form=("attacker",),
    )
    attacker_view: str = quantity(
        "white", choices=("white", "grey"), source="chosen: sees all, or own sensors only", form=("attacker",)
    )
    attacker_sees_choice: bool = quantity(
        True,
        source="chosen: a white-box attacker sees the last choice, estimate fed and heating; False as in 4.3, where "
        "the choice makes its knowledge of the control system uncertain",
    )
    series_split: str = quantity(
        "seed", choices=SPLITS, source="chosen: days of a series that an episode may be, by its seed, any, or of a half"
    )
    series_block_s: float = quantity(
        7 * DAY_S, unit="s", low=60, high=1e9, source="chosen: blocks of the halves, those for training come first"
    )

    def following(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Fields whose value follows from others that are given, where they are not given themselves."""
        capacity = given.get("heat_capacity_j_per_k", ())
        fits = isinstance(capacity, tuple) and all(isinstance(each, (int, float)) and each > 0 for each in capacity)
        return {"move_weight": fitting_weight(capacity)} if fits and capacity else {}

    @property
    def num_zones(self) -> int:
        """Number n of zones, and of heaters."""
        return len(self.heat_capacity_j_per_k)

    @property
    def reference_range_c(self) -> tuple[float, float]:
        """The least and the greatest set-point of any zone and time, C."""
        return extremes(self.reference_c)

    @property
    def heating_range_w(self) -> tuple[float, float]:
        """The least and the greatest power of any plant, W."""
        return extremes(self.min_heating_w)[0], extremes(self.max_heating_w)[1]

    @property
    def threshold_c2(self) -> float:
        """The bound eps of MTD2 on the mean residual of a set, C2."""
        return self.thresholds_c2[self.num_sensors // self.num_zones - 1]

    @property
    def max_compromised(self) -> int:
        """The most sensors that are compromised in any episode."""
        if self.compromised_weights:
            return max(count for count, weight in enumerate(self.compromised_weights) if weight > 0 or count == 0)
        return int(bounds(self.num_compromised)[1])

    @property
    def duration_h(self) -> float:
        """Time of the last state, h."""
        return (self.num_steps - 1) * self.step_s / 3600.0


def fitting_weight(capacity_j_per_k: Sequence[float]) -> float:
    """The `move_weight` with which the controller heats zones of these capacities, J/K, as it does the paper's, C2/W2.

    The heating that changes a zone's temperature as fast is in proportion to its capacity C, so R C^2 stays the same.
    """
    share = MEAN_CAPACITY_J_PER_K / (sum(capacity_j_per_k) / len(capacity_j_per_k))
    return max(LEAST_WEIGHT, float(f"{MOVE_WEIGHT * share**2:.3g}"))
