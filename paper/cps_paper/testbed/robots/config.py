"""The configuration of the test bed: robots, camera, filter, control, and the string of platoons that they form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from cps_envs.core.declare.config import is_multiple, quantity, validate
from cps_envs.core.errors import ConfigurationError
from cps_envs.disbanding.config import DisbandingConfig

CHOSEN = "chosen; section 2.5 prints none"
AVOIDANCE = ("always", "until_disbanding")


@dataclass(frozen=True)
class RobotConfig:
    """N platoons of n differential-drive robots on a circle; gaps are centre to centre along the arc.

    Raises:
        ConfigurationError: a value of wrong type, out of bounds, or that does not fit the others.
    """

    num_platoons: int = quantity(3, low=2, high=10, source="section 2.5")
    vehicles_per_platoon: int = quantity(3, low=2, high=10, source="section 2.5")
    duration_s: float = quantity(60.0, unit="s", low=1, high=3600, source=CHOSEN)
    measured_from_s: float = quantity(20.0, unit="s", low=0, high=3600, source="chosen: when platoon N disbands")
    measured_for_s: float = quantity(30.0, unit="s", low=1, high=3600, source="chosen: window of E_v")
    radius_m: float = quantity(1.5, unit="m", low=0.3, high=100, source=CHOSEN)
    body_length_m: float = quantity(0.10, unit="m", low=0.01, high=1, source="a Pololu m3pi")
    desired_gap_m: float = quantity(0.35, unit="m", low=0.1, high=10, source="chosen: x_d")
    headway_s: float = quantity(1.0, unit="s", low=0.1, high=10, source="chosen: h")
    proportional_gain: float = quantity(1.0, unit="1/s2", low=0, high=100, source="Table 2.1: k_p")
    derivative_gain: float = quantity(3.0, unit="1/s", low=0, high=100, source="chosen: k_d; Table 2.1 has 5")
    desired_speed_mps: float = quantity(0.25, unit="m/s", low=0.1, high=2, source="chosen: v_d")
    max_speed_mps: float = quantity(0.35, unit="m/s", low=0.1, high=2, source=CHOSEN)
    min_acceleration_mps2: float = quantity(-0.5, unit="m/s2", low=-2, high=-0.01, source="chosen: u_min")
    max_acceleration_mps2: float = quantity(0.1, unit="m/s2", low=0.01, high=2, source="chosen: 1:5, as in Table 2.1")
    standstill_gap_m: float = quantity(0.24, unit="m", low=0, high=2, source="chosen: r_0")
    driver_headway_s: float = quantity(1.3, unit="s", low=0.1, high=10, source="chosen: h of the human drivers")
    sudden_braking_mps2: float = quantity(0.5, unit="m/s2", low=0, high=2, source="chosen: on disbanding")
    sudden_braking_s: float = quantity(0.4, unit="s", low=0, high=10, source="chosen: how long")
    avoidance: str = quantity("always", choices=AVOIDANCE, source="chosen: (2.6) on mitigable robots")
    scale: float = quantity(10.0, low=1, high=100, source="chosen: metres of road per metre; u is Table 2.1's")
    dt_s: float = quantity(0.01, unit="s", low=1e-3, high=0.1, source="chosen: plant, camera and filter")
    control_period_s: float = quantity(0.05, unit="s", low=0.01, high=1, source=CHOSEN)
    radio_delay_s: float = quantity(0.05, unit="s", low=0, high=1, source="chosen: one control period")
    wheel_radius_m: float = quantity(0.016, unit="m", low=1e-3, high=1, source="a Pololu m3pi")
    wheel_base_m: float = quantity(0.083, unit="m", low=0.01, high=1, source="a Pololu m3pi: b")
    wheel_lag_s: float = quantity(0.10, unit="s", low=0.01, high=2, source="chosen: tau_w")
    max_wheel_speed: float = quantity(60.0, unit="rad/s", low=1, high=1000, source=CHOSEN)
    wheel_gain_spread: float = quantity(0.02, low=0, high=0.2, source="chosen: standard deviation, fixed per wheel")
    speed_noise_mps: float = quantity(0.0002, unit="m/s", low=0, high=0.1, source="chosen: while the robot moves")
    camera_noise_m: float = quantity(0.0005, unit="m", low=0, high=0.1, source="chosen: per axis, at each plant step")
    heading_drift: float = quantity(0.3, unit="rad/s^0.5", low=0, high=10, source="chosen: q_theta of the filter")
    speed_drift: float = quantity(0.1, unit="m/s^1.5", low=0, high=10, source="chosen: q_v of the filter")
    lookahead_m: float = quantity(0.20, unit="m", low=0.02, high=10, source="chosen: of pure pursuit, along the arc")
    speed_gain: float = quantity(1.0, low=0, high=100, source="chosen: K_p = tau_w / 0.05 s - 1")
    speed_integral_gain: float = quantity(0.1, unit="1/s", low=0, high=100, source="chosen: K_i")
    max_integral_m: float = quantity(0.05, unit="m", low=0, high=10, source="chosen: limit of the integral")

    def __post_init__(self) -> None:
        validate(self)
        for name, whole, part in (
            ("control_period_s", self.control_period_s, "dt_s"),
            ("duration_s", self.duration_s, "control_period_s"),
            ("measured_for_s", self.measured_for_s, "control_period_s"),
        ):
            if not is_multiple(whole, getattr(self, part)):
                raise ConfigurationError(f"{name} = {whole} has to be a multiple of {part} = {getattr(self, part)}.")
        if self.radio_delay_s and not is_multiple(self.radio_delay_s, self.control_period_s):
            raise ConfigurationError(
                f"radio_delay_s = {self.radio_delay_s} has to be 0 or a multiple of control_period_s = "
                f"{self.control_period_s}."
            )
        if self.string_length_m >= 2 * math.pi * self.radius_m:
            raise ConfigurationError(
                f"the robots need {self.string_length_m:.2f} m, more than the circle has: choose a larger radius_m "
                f"than {self.radius_m}, or fewer robots."
            )
        _ = self.road  # what does not fit a string of platoons

    @property
    def num_robots(self) -> int:
        """M."""
        return self.num_platoons * self.vehicles_per_platoon

    @property
    def string_length_m(self) -> float:
        """From the front of the first robot to the rear of the last one, in steady state."""
        inside = self.num_platoons * (self.vehicles_per_platoon - 1) * self.desired_gap_m
        return inside + (self.num_platoons - 1) * self.headway_s * self.desired_speed_mps + self.body_length_m

    @property
    def steps_per_period(self) -> int:
        """Plant steps in a control period."""
        return round(self.control_period_s / self.dt_s)

    @property
    def delay_periods(self) -> int:
        """Control periods between the decision and the action of a command."""
        return round(self.radio_delay_s / self.control_period_s)

    @property
    def num_periods(self) -> int:
        """Control periods in an episode."""
        return round(self.duration_s / self.control_period_s)

    @property
    def window(self) -> tuple[int, int]:
        """E_v counts the ends of the control periods after the first and up to the second of these."""
        first = round(self.measured_from_s / self.control_period_s)
        return first, first + round(self.measured_for_s / self.control_period_s)

    @property
    def road(self) -> DisbandingConfig:
        """The string as policies see it: lengths, speeds and accelerations times `scale`, times as they are.

        Scaling lengths alone leaves every law the same law, and with `scale` 10 the limits of acceleration are those of
        Table 2.1, so that corrections, dead bands and coefficients made for the road mean the same here.
        """
        scale = self.scale
        return DisbandingConfig(
            num_platoons=self.num_platoons,
            vehicles_per_platoon=self.vehicles_per_platoon,
            duration_s=self.duration_s,
            tau_s=self.wheel_lag_s,
            desired_gap_m=scale * self.desired_gap_m,
            headway_s=self.headway_s,
            proportional_gain=self.proportional_gain,
            derivative_gain=self.derivative_gain,
            desired_speed_mps=scale * self.desired_speed_mps,
            max_speed_mps=scale * self.max_speed_mps,
            min_acceleration_mps2=scale * self.min_acceleration_mps2,
            max_acceleration_mps2=scale * self.max_acceleration_mps2,
            standstill_gap_m=scale * self.standstill_gap_m,
            control_period_s=self.control_period_s,
            attack_budget=self.num_platoons,
            driver_headway_s=self.driver_headway_s,
        )


BASELINE = RobotConfig()
MITIGATED = replace(BASELINE, avoidance="until_disbanding")  # the mitigation of section 2.5 replaces (2.6)
PRESETS = {"paper": BASELINE, "mitigated": MITIGATED}
