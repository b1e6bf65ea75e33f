"""The configuration of the rogue-vehicle problem and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cps_envs.core.declare.bodies import names_each, spans
from cps_envs.core.declare.config import (
    IntRange,
    Range,
    RangedBodies,
    bounds,
    check_bodies,
    is_multiple,
    over_time,
    quantity,
    validate,
)
from cps_envs.core.declare.cycles import shipped_cycle
from cps_envs.core.declare.objective import Payoff, objective
from cps_envs.core.declare.places import SPLITS, Places, place_episodes
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray
from cps_envs.rogue.stability import longest_stable_step_s

TABLE = "Table 5.1"
RATIO = f"{TABLE}: alpha_att / alpha is at least 1"
GAINS = "chosen within 0 < n_3 < n_2 < n_1 < 1"
DRIVER = "Table 2.1, for (2.5)"
CONTACT = "chosen: (5.8) does not say what follows a collision; solid is physical"
BUMPERS = "chosen: with 'solid' an impact does damage by its speed beyond this"
NOISE = "chosen: standard deviation of what is observed"
ORDERS = "chosen: with 'all' the seized vehicle is not marked; it obeys until the onset"
FORM = "chosen: controllers, accelerations, or for each vehicle one of either"
TEAM = "1.1.2, 2.1.2: vehicles that attack together, in place of attacker_index"
COST = "chosen: saturating mean errors, or log(1 + mean distance / sigma) from the places or from the open places"
NEUTRAL = "chosen: of all, by the defender's neutral action"


OF_VEHICLES = ("drive_mps2", "drag_per_s", "vehicle_length_m", "proportional_gain", "derivative_gain")


@dataclass(frozen=True)
class RogueConfig:
    """A platoon of n vehicles, numbered 1 (rear) to n (leader), one or several of them driven by an attacker.

    A field marked as ranged takes a number, or a pair (low, high) from which every reset draws uniformly. A seat that
    is drawn up to `num_vehicles` of the longest platoon may be the leader's; else it never is. Drive, drag, length and
    the gains also take a tuple with a value for each vehicle of the longest platoon, from the rear.

    Raises:
        ConfigurationError: a value of wrong type, out of bounds, or that does not fit the others.
    """

    num_vehicles: IntRange = quantity(5, low=3, high=100, source="paper: n", ranged=True)
    attacker_index: IntRange = quantity(
        3, low=1, high=100, source="paper: 3; 1 = rear", ranged=True, instead_of="attacker_indices"
    )
    attacker_indices: tuple[int, ...] = quantity((), low=1, high=100, source=TEAM)
    power_ratio: Range = quantity(1.0, low=1, high=3, source=RATIO, ranged=True)
    drive_mps2: RangedBodies = quantity(
        5.0, unit="m/s2", low=1, high=20, source=f"{TABLE}: alpha", ranged=True, bodies="vehicle"
    )
    drag_per_s: RangedBodies = quantity(
        0.1, unit="1/s", low=0.01, high=1, source=f"{TABLE}: beta", ranged=True, bodies="vehicle"
    )
    min_effort: float = quantity(-1.0, low=-5, high=0, source="reconstructed: F-, missing in Table 5.1")
    max_effort: float = quantity(1.0, low=0.1, high=5, source=f"{TABLE}: F+")
    separation_m: float = quantity(9.0, unit="m", low=2, high=100, source="paper: sigma_ref, between centres")
    reference_speed_mps: Range = quantity(25.0, unit="m/s", low=1, high=60, source="paper: v_ref", ranged=True)
    vehicle_length_m: RangedBodies = quantity(
        4.5, unit="m", low=1, high=30, source="paper: l", ranged=True, bodies="vehicle"
    )
    proportional_gain: RangedBodies = quantity(
        1.0, unit="1/s2", low=0, high=100, source="(5.15): k_p", ranged=True, bodies="vehicle"
    )
    derivative_gain: RangedBodies = quantity(
        3.0, unit="1/s", low=0, high=100, source="(5.15): k_d", ranged=True, bodies="vehicle"
    )
    surface_slope_per_s: float = quantity(0.1, unit="1/s", low=0, high=10, source=f"{TABLE}: k_1")
    boundary_layer_mps: float = quantity(0.025, unit="m/s", low=1e-3, high=10, source=f"{TABLE}: epsilon")
    max_speed_mps: float = quantity(50.0, unit="m/s", low=1, high=200, source="reconstructed: alpha F+ / beta")
    max_acceleration_mps2: float = quantity(5.0, unit="m/s2", low=0.1, high=50, source="reconstructed: alpha")
    alarm_threshold: float = quantity(200.0, unit="m2/s3", low=1, high=1e4, source=f"{TABLE}: l_1; l_2 is not used")
    detector_cutoff_hz: float = quantity(0.01, unit="Hz", low=1e-3, high=10, source=f"{TABLE}: f_cutoff")
    outer_share: float = quantity(0.75, low=0.01, high=1, source=f"n_1, {GAINS}")
    middle_share: float = quantity(0.5, low=0.01, high=1, source=f"n_2, {GAINS}")
    inner_share: float = quantity(0.1, low=0.01, high=1, source=f"n_3, {GAINS}")
    growth_step_m: float = quantity(0.5, unit="m", low=0.01, high=5, source="paper: growth of the separation")
    growth_interval_s: float = quantity(0.1, unit="s", low=1e-3, high=10, source="chosen: t_inc")
    max_growth_m: float = quantity(10.0, unit="m", low=1, high=100, source="chosen; the paper's thresholds are 2, 4, 7")
    driver_acceleration_mps2: float = quantity(1.0, unit="m/s2", low=0.1, high=10, source=DRIVER)
    driver_braking_mps2: float = quantity(5.0, unit="m/s2", low=0.1, high=20, source=DRIVER)
    driver_headway_s: float = quantity(1.5, unit="s", low=0.1, high=10, source=DRIVER)
    driver_gap_m: float = quantity(1.0, unit="m", low=0, high=20, source=f"{DRIVER}: r_0")
    human_returns: bool = quantity(False, source="chosen: a human leader drives back to the reference")
    contact: str = quantity("pass", choices=("pass", "solid"), source=CONTACT)
    bumper_mps: float = quantity(0.0, unit="m/s", low=0, high=20, source=BUMPERS)
    duration_s: float = quantity(100.0, unit="s", low=1, high=3600, source="chosen: T")
    dt_s: float = quantity(0.001, unit="s", low=1e-5, high=0.1, source="chosen: integration step")
    control_period_s: float = quantity(
        0.1, unit="s", low=0.01, high=1, source="chosen: the defender's decision", form=("defender",)
    )
    attack_hold_s: float = quantity(
        0.1, unit="s", low=0.1, high=10, source="chosen: the attacker's decision", form=("attacker",)
    )
    onset_s: Range = quantity(0.0, unit="s", low=0, high=60, source="chosen: drives as `sliding` before", ranged=True)
    attack_share: float = quantity(1.0, low=0, high=1, source="chosen: share of the episodes that have an attack")
    orders: str = quantity("intact", choices=("intact", "all"), source=ORDERS, form=("defender",))
    defense_action: str = quantity("mode", choices=("mode", "command", "either"), source=FORM, form=("defender",))
    neutral_controller: str = quantity("linear", choices=("linear", "sliding"), source=NEUTRAL)
    formation_cost: str = quantity("scattering", choices=("scattering", "log_place", "open_place"), source=COST)
    formation_weight_mps2: float = quantity(0.0, unit="m/s2", low=0, high=10, source="chosen: w, price of scattering")
    payoff: Payoff = objective({"damage": {}}, source="(5.8): D and w times the formation cost; others chosen")
    spacing_spread_m: float = quantity(0.0, unit="m", low=0, high=2, source="chosen: initial separations +- this")
    speed_spread_mps: float = quantity(0.0, unit="m/s", low=0, high=2, source="chosen: initial speeds +- this")
    range_noise_m: float = quantity(0.0, unit="m", low=0, high=5, source=NOISE)
    range_rate_noise_mps: float = quantity(0.0, unit="m/s", low=0, high=5, source=NOISE)
    speed_noise_mps: float = quantity(0.0, unit="m/s", low=0, high=5, source=f"{NOISE} by the defender")
    acceleration_noise_mps2: float = quantity(0.0, unit="m/s2", low=0, high=5, source=NOISE)
    leader_speed_mps: float | Series = quantity(
        0.0, unit="m/s", low=0, high=60, source="chosen: v_ref over time; 0: reference_speed_mps", series="linear"
    )
    series_split: str = quantity("seed", choices=SPLITS, source="chosen: which part of the series; seed: by its use")
    series_block_s: float = quantity(120.0, unit="s", low=1, high=86_400, source="chosen: learnt and judged by turns")

    def __post_init__(self) -> None:
        validate(self)
        self._check_times()
        self._check_sizes()
        self._check_cycle()
        if self.dt_s >= self.stable_below_s:
            raise ConfigurationError(
                f"dt_s = {self.dt_s}: with {self.max_vehicles} vehicles the sliding mode is stable only below "
                f"{self.stable_below_s:.3g} s. Choose {self._stable_step()} or a wider boundary_layer_mps."
            )

    def _check_times(self) -> None:
        for name, whole, part in (
            ("control_period_s", self.control_period_s, "dt_s"),
            ("growth_interval_s", self.growth_interval_s, "dt_s"),
            ("attack_hold_s", self.attack_hold_s, "control_period_s"),
            ("duration_s", self.duration_s, "attack_hold_s"),
        ):
            if not is_multiple(whole, getattr(self, part)):
                raise ConfigurationError(
                    f"{name} = {whole} has to be a multiple of {part} = {getattr(self, part)}. Choose for example "
                    "dt_s=0.001, control_period_s=0.1, attack_hold_s=0.1, growth_interval_s=0.1 and whole seconds."
                )

    def _check_sizes(self) -> None:
        check_bodies(self, {"vehicle": self.max_vehicles})
        self._check_seats()
        longest_m = float(self.pair_length_m.max())
        if self.separation_m <= longest_m + 2 * self.spacing_spread_m:
            raise ConfigurationError(
                f"separation_m = {self.separation_m} leaves vehicles of vehicle_length_m = {self.vehicle_length_m} in "
                "contact at the start; choose a larger separation: it is between centres, and above "
                f"{longest_m + 2 * self.spacing_spread_m:g} m."
            )
        if not self.inner_share < self.middle_share < self.outer_share:
            raise ConfigurationError(
                f"inner_share = {self.inner_share} < middle_share = {self.middle_share} < outer_share = "
                f"{self.outer_share} is required."
            )
        top_speed = float((spans(self.drive_mps2)[0] * self.max_effort / spans(self.drag_per_s)[1]).min())
        given = "leader_speed_mps" if self.has_cycle else "reference_speed_mps"
        if self.reference_range_mps[1] >= top_speed:
            raise ConfigurationError(
                f"{given} = {getattr(self, given)} is out of reach: drive and drag allow {top_speed:g} m/s."
            )

    def _check_seats(self) -> None:
        fewest, (first, last) = int(bounds(self.num_vehicles)[0]), bounds(self.attacker_index)
        seats = self.attacker_indices
        ordered = list(seats) == sorted(set(seats))
        if not ordered or len(seats) in (1, fewest) or max(seats, default=1) > fewest:
            raise ConfigurationError(
                f"attacker_indices = {seats} has to name at least two different vehicles from the rear, none beyond "
                f"vehicle {fewest}, and to leave an intact one. Choose for example (2, {max(3, fewest - 1)}); one "
                "vehicle is attacker_index."
            )
        if not seats and (first > fewest - (not self.leader_may_be_seized) or last > self.max_vehicles):
            raise ConfigurationError(
                f"attacker_index = {self.attacker_index} has to be within num_vehicles = {self.num_vehicles}. Choose "
                f"for example (1, {self.max_vehicles - 1}) for any vehicle but the leader, or (1, {self.max_vehicles}) "
                f"for any vehicle; drawn seats have to begin {'at' if self.leader_may_be_seized else 'below'} {fewest}."
            )

    def _check_cycle(self) -> None:
        series = self.leader_speed_mps
        if not isinstance(series, Series):
            if series != 0:
                raise ConfigurationError(
                    f"leader_speed_mps = {series} is one number: give it as reference_speed_mps, or a series here."
                )
            return
        if series.width > 1:
            raise ConfigurationError("leader_speed_mps has several columns: give that of the leader alone.")
        speed = series.values[:, 0]
        gained = np.diff(speed) / series.step_s
        drive, drag = spans(self.drive_mps2)[0], spans(self.drag_per_s)
        most = (drive * self.max_effort - drag[1] * speed[1:, np.newaxis]).min(axis=1)
        least = (drive * self.min_effort - drag[0] * speed[1:, np.newaxis]).max(axis=1)
        wrong = np.flatnonzero((gained > most) | (gained < least))
        if len(wrong):
            k = int(wrong[0])
            raise ConfigurationError(
                f"leader_speed_mps, {series.place(k + 1)}: it changes by {gained[k]:.3g} m/s2, where some vehicle is "
                f"capable of {least[k]:.3g} to {most[k]:.3g} m/s2, so that nobody could keep the platoon together: "
                "give drive_mps2, or max_effort and min_effort, that can follow, or a calmer series."
            )

    def _stable_step(self) -> str:
        """The largest of the usual steps that is stable and divides the other times."""
        usual = (digit * 10.0**exponent for exponent in range(-2, -6, -1) for digit in (5, 2, 1))
        for step_s in usual:
            fits = is_multiple(self.control_period_s, step_s) and is_multiple(self.growth_interval_s, step_s)
            if step_s < self.stable_below_s and fits:
                return f"dt_s={step_s:g}"
        return "a smaller dt_s"

    @property
    def stable_below_s(self) -> float:
        """The integration step (s) from which on the sliding mode is unstable, see `stability`."""
        layer, (first, last) = self.boundary_layer_mps, self.seat_range
        authority = 2 * self.surface_slope_per_s * self.max_speed_mps + self.max_acceleration_mps2
        disguised = bounds(self.onset_s)[1] > 0 or self.attack_share < 1
        places = [self.attacker_indices] if self.attacker_indices else [(seat,) for seat in range(first, last + 1)]
        return longest_stable_step_s(self.max_vehicles, places, (authority + layer) / layer, disguised=disguised)

    @property
    def steps_per_period(self) -> int:
        """Integration steps in a game step."""
        return round(self.control_period_s / self.dt_s)

    @property
    def max_vehicles(self) -> int:
        """Vehicles of the longest platoon; arrays are as long."""
        return int(bounds(self.num_vehicles)[1])

    @property
    def has_cycle(self) -> bool:
        """Whether the reference speed is a series."""
        return isinstance(self.leader_speed_mps, Series)

    @property
    def places(self) -> Places:
        """Where in that series episodes may begin, in control periods."""
        series = [self.leader_speed_mps] if isinstance(self.leader_speed_mps, Series) else []
        return place_episodes(
            series,
            step_s=self.control_period_s,
            steps=round(self.duration_s / self.control_period_s) + 1,
            every_s=1.0,
            split=self.series_split,
            block_s=self.series_block_s,
        )

    @property
    def leader_mps(self) -> FloatArray:
        """The reference speed (K,) over the time of the series, one for each control period; (0,) without one."""
        if not self.has_cycle:
            return np.empty(0)
        places = self.places
        times_s = places.begin_s + np.arange(places.steps, dtype=np.float64) * self.control_period_s
        return over_time(self, "leader_speed_mps", times_s, 1)[:, 0].copy()

    @property
    def reference_range_mps(self) -> tuple[float, float]:
        """The lowest and the highest reference speed that an episode can have."""
        if isinstance(self.leader_speed_mps, Series):
            return float(self.leader_speed_mps.values.min()), float(self.leader_speed_mps.values.max())
        return bounds(self.reference_speed_mps)

    @property
    def num_bodies(self) -> int:
        """Vehicles that a configuration tells apart: all of the longest platoon, or 1 where all are alike."""
        return self.max_vehicles if any(names_each(getattr(self, name)) for name in OF_VEHICLES) else 1

    @property
    def pair_length_m(self) -> FloatArray:
        """Between the centres of each pair in contact, at most: (n - 1,), or (1,) where all vehicles are alike."""
        length: FloatArray = spans(self.vehicle_length_m)[1]
        return length if length.size == 1 else np.asarray(0.5 * (length[1:] + length[:-1]))

    @property
    def num_seized(self) -> int:
        """Vehicles that the attacker drives."""
        return max(len(self.attacker_indices), 1)

    @property
    def seat_range(self) -> tuple[int, int]:
        """The first and the last seat, 1 = rear, that any seized vehicle can have."""
        low, high = bounds(self.attacker_indices or self.attacker_index)
        return int(low), int(high)

    @property
    def leader_may_be_seized(self) -> bool:
        """Whether drawn seats reach up to the leader of every platoon, and not only to the vehicle behind it."""
        return self.seat_range[1] >= self.max_vehicles

    @property
    def num_intact(self) -> int:
        """Vehicles of the longest platoon without the seized ones."""
        return self.max_vehicles - self.num_seized

    @property
    def hidden(self) -> bool:
        """Whether the defender is not told who is seized, and gives orders to all."""
        return self.orders == "all"

    @property
    def num_orders(self) -> int:
        """Vehicles that the defender gives orders to."""
        return self.max_vehicles if self.hidden else self.num_intact


PAPER = RogueConfig()
EASY = replace(
    PAPER,
    contact="solid",
    duration_s=60.0,
    dt_s=0.0005,
    power_ratio=(1.0, 1.6),
    drive_mps2=(4.75, 5.25),
    drag_per_s=(0.095, 0.105),
    reference_speed_mps=(20.0, 30.0),
    onset_s=(0.0, 10.0),
    spacing_spread_m=0.5,
    speed_spread_mps=0.2,
    range_noise_m=0.05,
    range_rate_noise_mps=0.02,
    acceleration_noise_mps2=0.5,
    formation_weight_mps2=0.5,
)
LEARNING = replace(
    EASY,
    num_vehicles=(4, 8),
    attacker_index=(1, 7),
    orders="all",
    power_ratio=(1.0, 1.3),
    onset_s=(0.0, 30.0),
    attack_share=0.75,
    boundary_layer_mps=0.1,  # four times that of the paper, so that steps of 2 ms are stable and exact enough
    dt_s=0.002,
    range_noise_m=0.5,
    range_rate_noise_mps=0.5,
    speed_noise_mps=0.5,
    acceleration_noise_mps2=2.0,
    bumper_mps=2.0,  # 49 CFR 581: no damage at 2.5 mph against a barrier, as 2.2 m/s do between equal vehicles
    defense_action="either",
    neutral_controller="sliding",  # the best of the controllers, if all vehicles keep it
    formation_cost="open_place",
    formation_weight_mps2=0.2,
)
OSCILLATION = replace(  # Fig. 5.2: ten vehicles with the attacker at the rear; the rest as in `paper`
    PAPER,
    num_vehicles=10,
    attacker_index=1,
    power_ratio=2.0,  # chosen: at equal power the oscillation does not grow
    contact="solid",
    dt_s=0.0005,  # ten vehicles are stable below 0.85 ms
)
SEATS = replace(  # section 5.2.3: "at an arbitrary position"; the rest as in `paper`
    PAPER,
    num_vehicles=(5, 10),
    attacker_index=(1, 9),
    dt_s=0.0005,
)
CITY = replace(LEARNING, leader_speed_mps=shipped_cycle("udds"))  # 23 minutes of stop and go, in blocks of two
PRESETS = {
    "paper": PAPER,
    "oscillation": OSCILLATION,
    "seats": SEATS,
    "easy": EASY,
    "learning": LEARNING,
    "city": CITY,
}
