"""The configuration of the false-data-injection problem and its presets."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cps_envs.core.declare.config import Bodies, Range, bounds, check_bodies, is_multiple, quantity, validate
from cps_envs.core.declare.objective import Payoff, objective
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray
from cps_envs.fdi.model import DISCRETISATIONS, Model, platoon_model
from cps_envs.fdi.task import Task, make_task, parse_task

SLACK = 1e-9  # of the quotient bound / resolution, so that 10 / 0.25 is 40
FREE = "not stated for chapter 3; chosen"
TASK_GROUPS = ("single", "pairs", "feasible")
SYSTEM = (  # what numbers of policies were found for
    *("num_vehicles", "desired_gap_m", "proportional_gain", "derivative_gain", "min_acceleration_mps2"),
    *("max_acceleration_mps2", "dt_s", "range_resolution_m", "rate_resolution_mps", "range_noise_m", "rate_noise_mps"),
    *("max_correction_mps2",),
)
NEED_FILTER = ("range_noise_m", "rate_noise_mps", "quantised", "attack_share", "onset_s")


@dataclass(frozen=True)
class FdiConfig:
    """A platoon of n vehicles, an attacker who adds multiples of the resolution to sensor readings, a defender.

    The noise of sensors is one number for all, or one for each: the fronts of vehicles 1 (last) to n, then the rears of
    2 to n. The printed tables do not identify the gains and the limits: k_p 1 to 2, k_d 2 to 5, u_min -8 to -4 and
    u_max 4 to 5 m/s2 fit about equally well.

    Raises:
        ConfigurationError: a value of wrong type, out of bounds, or that does not fit the others.
    """

    num_vehicles: int = quantity(4, low=2, high=100, source="Tables 3.1-3.6; 5 in Table 3.7, 10 in Fig. 3.2: n")
    attacked: str = quantity("x4", source="Tables 3.1-3.7: x range, v range-rate, xv both; 1 = last vehicle")
    target: int = quantity(4, low=1, high=100, source="Tables 3.1-3.7: vehicle that is to hit the one ahead")
    tasks: str = quantity("", source="chosen: tasks such as 'x4>4 v1>1', or single, pairs, feasible, to draw from")
    horizon: int = quantity(20, unit="steps", low=1, high=100_000, source=f"m; {FREE}")
    desired_gap_m: float = quantity(5.0, unit="m", low=0.5, high=100, source="Fig. 3.2: x_d")
    proportional_gain: float = quantity(1.0, unit="1/s2", low=0, high=100, source=f"k_p; {FREE}")
    derivative_gain: float = quantity(3.0, unit="1/s", low=0, high=100, source=f"k_d; {FREE}")
    min_acceleration_mps2: float = quantity(-5.0, unit="m/s2", low=-20, high=-0.1, source=f"u_min; {FREE}")
    max_acceleration_mps2: float = quantity(5.0, unit="m/s2", low=0.1, high=20, source=f"u_max; {FREE}")
    limit_commands: bool = quantity(True, source="(3.49); not in Algorithm 2")
    limit_readings: bool = quantity(True, source="(3.50): a spoofed range is at least 0; chosen")
    dt_s: float = quantity(0.2, unit="s", low=0.005, high=1, source=FREE)
    discretisation: str = quantity("zoh", choices=DISCRETISATIONS, source=FREE)
    limits: str = quantity("hard", choices=("hard", "clip"), source="chosen: illegal moves end the episode, or clip")
    range_resolution_m: float = quantity(0.5, unit="m", low=0.001, high=50, source="section 3.5")
    rate_resolution_mps: float = quantity(0.25, unit="m/s", low=0.001, high=50, source="section 3.5, which prints m/s2")
    max_range_injection_m: float = quantity(50.0, unit="m", low=0.001, high=1000, source=FREE)
    max_rate_injection_mps: float = quantity(10.0, unit="m/s", low=0.001, high=1000, source=FREE)
    paid_pair: str = quantity("target", choices=("target", "any"), source="chosen: whose impact speed counts")
    goal: str = quantity(
        "collision",
        choices=("collision", "instability"),
        source="sections 3.4 and 3.3: paid is the impact speed, or what the errors (3.20) of `paid_pair` have grown",
    )
    payoff: Payoff = objective({"goal": {}}, source="chosen: what `goal` says and the defender's charges, or other pay")
    max_correction_mps2: float = quantity(2.0, unit="m/s2", low=0.1, high=20, source="chosen: c_max of the defender")
    correction_levels: int = quantity(
        4, low=1, high=100, source="chosen: steps between 0 and c_max", form=("defender",)
    )
    alarm_cost_mps2: float = quantity(0.01, unit="m/s2", low=0, high=10, source="chosen: per replaced reading")
    correction_cost: float = quantity(0.01, low=0, high=10, source="chosen: times the mean size of the corrections")
    gap_spread_m: float = quantity(0.0, unit="m", low=0, high=2, source="chosen: initial gap errors +- this")
    speed_spread_mps: float = quantity(0.0, unit="m/s", low=0, high=2, source="chosen: initial relative speeds +- this")
    disturbance_mps2: Range = quantity(
        0.0, unit="m/s2", low=0, high=2, ranged=True, source="chosen: deviation of accelerations"
    )
    disturbance_hold_s: float = quantity(
        0.0, unit="s", low=0, high=100, source="chosen: a disturbance lasts this long; 0: one step"
    )
    own_phases: bool = quantity(False, source="chosen: each vehicle's disturbances change at drawn times of its own")
    gain_spread: float = quantity(0.0, low=0, high=0.5, source="chosen: k_p and k_d are drawn +- this part of them")
    estimator: str = quantity(
        "model", choices=("model", "kalman"), source="chosen: what replaces a reading; kalman: of all sensors, noisy"
    )
    range_noise_m: Bodies = quantity(
        0.0, unit="m", low=0, high=5, source="chosen: deviation of range readings", bodies="range sensor"
    )
    rate_noise_mps: Bodies = quantity(
        0.0, unit="m/s", low=0, high=5, source="chosen: deviation of range-rate readings", bodies="range-rate sensor"
    )
    quantised: bool = quantity(False, source="chosen: honest readings are whole multiples of the resolution too")
    attack_share: float = quantity(1.0, low=0, high=1, source="chosen: part of the episodes in which injections work")
    onset_s: Range = quantity(
        0.0, unit="s", low=0, high=1000, ranged=True, source="chosen: injections work from then on"
    )
    alarm_after_s: float = quantity(
        0.5, unit="s", low=0.001, high=100, source="chosen: a reading replaced for so long is an alarm"
    )

    def __post_init__(self) -> None:
        validate(self)
        check_bodies(self, {"range sensor": self.num_readings // 2, "range-rate sensor": self.num_readings // 2})
        self._check_task()
        self._check_duel()
        self._check_levels()
        if self.limits == "clip" and self.discretisation != "zohu":
            raise ConfigurationError(
                'limits = "clip" holds clipped commands over the step: it needs discretisation = "zohu", and a dt_s at '
                'which that is stable, such as 0.1 s, as in preset "defense".'
            )
        if not self.model.spectral_radius < 1:
            raise ConfigurationError(
                f"the platoon is unstable without any attack: spectral radius {self.model.spectral_radius:.3f} with "
                f"discretisation = {self.discretisation!r}, dt_s = {self.dt_s}, derivative_gain = "
                f'{self.derivative_gain}. Use a smaller dt_s (euler and zohu need about k_d dt lambda < 2) or "zoh".'
            )

    def _check_task(self) -> None:
        self.fixed_task  # noqa: B018, raises
        self.listed_tasks  # noqa: B018, raises
        fewest = self.fewest_steps
        if self.limit_commands and self.horizon < fewest:
            raise ConfigurationError(
                f"horizon = {self.horizon} is below the first feasible step: with accelerations in "
                f"[{self.min_acceleration_mps2:g}, {self.max_acceleration_mps2:g}] m/s2 no gap of "
                f"{self.desired_gap_m:g} m can close in less than {fewest} steps of {self.dt_s:g} s."
            )

    def _check_duel(self) -> None:
        if self.estimator == "kalman" and self.limits != "clip":
            raise ConfigurationError('estimator = "kalman" predicts held commands: it needs limits = "clip".')
        needing = [name for name in NEED_FILTER if getattr(self, name) != getattr(type(self), name)]
        rears = any(task.sensors.has_rear for task in (self.fixed_task, *self.listed_tasks))
        if self.estimator != "kalman" and (needing or rears):
            wanted = needing[0] if needing else "an attack on a rear sensor"
            raise ConfigurationError(f'{wanted} needs estimator = "kalman", as in preset "learning".')
        if self.gain_spread > 0 and self.discretisation != "zohu":
            raise ConfigurationError('gain_spread above 0 needs discretisation = "zohu", as in preset "drawn".')
        if self.disturbance_hold_s > 0 and not is_multiple(self.disturbance_hold_s, self.dt_s):
            raise ConfigurationError(
                f"disturbance_hold_s = {self.disturbance_hold_s} must be a multiple of dt_s = {self.dt_s}, or 0."
            )

    def _check_levels(self) -> None:
        attacked = [task.sensors for task in self.listed_tasks or (self.fixed_task,)]
        ranges = any(sensors.range or sensors.rear_range for sensors in attacked)
        rates = any(sensors.range_rate or sensors.rear_rate for sensors in attacked)
        for possible, levels, bound, resolution in (
            (ranges, self.range_levels, "max_range_injection_m", "range_resolution_m"),
            (rates, self.rate_levels, "max_rate_injection_mps", "rate_resolution_mps"),
        ):
            if levels < 1 and (possible or self.tasks in TASK_GROUPS):
                raise ConfigurationError(
                    f"{bound} = {getattr(self, bound)} is below {resolution} = {getattr(self, resolution)}, so that no "
                    f"injection but 0 is possible. Raise {bound}, lower {resolution}, or attack other sensors."
                )

    @property
    def num_readings(self) -> int:
        """Sensors: ranges, then range-rates; of the fronts 1..n and, with a filter, of the rears of 2..n."""
        return 4 * self.num_vehicles - 2 if self.estimator == "kalman" else 2 * self.num_vehicles

    @property
    def sensor_noise(self) -> FloatArray:
        """The deviation (R,) of each reading, m and m/s: fronts 1..n, then rears 2..n; ranges, then range-rates."""
        half = self.num_readings // 2
        return np.concatenate([np.broadcast_to(noise, half) for noise in (self.range_noise_m, self.rate_noise_mps)])

    @property
    def hold_steps(self) -> int:
        """Steps for which a disturbance lasts."""
        return max(round(self.disturbance_hold_s / self.dt_s), 1)

    @property
    def most_blocks(self) -> int:
        """Disturbances that a vehicle feels in an episode, at most."""
        steps = self.horizon + (self.hold_steps - 1 if self.own_phases else 0)
        return math.ceil(steps / self.hold_steps) if self.disturbed else 0

    @property
    def disturbed(self) -> bool:
        """Whether vehicles feel disturbances."""
        return bounds(self.disturbance_mps2)[1] > 0

    @property
    def fewest_steps(self) -> int:
        """A step before which nobody can collide: both vehicles of a pair accelerate as hard as they may."""
        closing_mps2 = self.max_acceleration_mps2 - self.min_acceleration_mps2
        return math.ceil(math.sqrt(2 * self.desired_gap_m / closing_mps2) / self.dt_s - SLACK)

    @property
    def model(self) -> Model:
        """The sampled platoon."""
        return platoon_model(
            self.num_vehicles, self.proportional_gain, self.derivative_gain, self.dt_s, self.discretisation
        )

    @property
    def fixed_task(self) -> Task:
        """The task of `attacked` and `target`."""
        return make_task(self.attacked, self.target, self.num_vehicles)

    @property
    def listed_tasks(self) -> tuple[Task, ...]:
        """The tasks that `tasks` spells out; none where it is empty or names a group."""
        if self.tasks in TASK_GROUPS:
            return ()
        return tuple(parse_task(text, self.num_vehicles) for text in self.tasks.split())

    def form_like(self, trained: FdiConfig, role: str) -> dict[str, str]:
        """What else lets a network see as in `trained`: an attacker that was told its task is told the one of here."""
        told = role == "attacker" and trained.tasks and not self.tasks
        return {"tasks": str(self.fixed_task)} if told else {}

    @property
    def range_levels(self) -> int:
        """The largest range injection in units of the resolution, (3.48)."""
        return math.floor(self.max_range_injection_m / self.range_resolution_m + SLACK)

    @property
    def rate_levels(self) -> int:
        """The largest range-rate injection in units of the resolution, (3.48)."""
        return math.floor(self.max_rate_injection_mps / self.rate_resolution_mps + SLACK)


A = FdiConfig()
DEFENSE = replace(
    A,
    tasks="feasible",
    limits="clip",
    discretisation="zohu",
    dt_s=0.1,
    horizon=100,
    paid_pair="any",
    gap_spread_m=0.1,
    speed_spread_mps=0.1,
    disturbance_mps2=0.1,
)
LEARNING = replace(
    DEFENSE,
    tasks="v4>4 xv4>4 v1+rv2>1 xv1+rv2>1 v2+rv3>2 xv3+rv4>3 xv2>2 x4>4",
    max_range_injection_m=10.0,
    max_rate_injection_mps=5.0,
    gap_spread_m=0.5,
    speed_spread_mps=0.2,
    gain_spread=0.2,
    disturbance_mps2=(0.3, 0.5),
    disturbance_hold_s=1.0,
    own_phases=True,
    estimator="kalman",
    range_noise_m=0.25,
    rate_noise_mps=0.1,
    quantised=True,
    attack_share=0.75,
    onset_s=(0.0, 3.0),
)
DRAWN = replace(
    A,
    tasks="single",
    discretisation="zohu",
    dt_s=0.1,
    horizon=40,
    gap_spread_m=0.5,
    speed_spread_mps=0.2,
    gain_spread=0.2,
)
PRESETS = {
    "paper": A,
    "easy": replace(A, tasks="feasible"),
    "learning": LEARNING,
    "drawn": DRAWN,
    "defense": DEFENSE,
}
SIZES = ("num_vehicles", "attacked", "tasks", "goal", "estimator", "correction_levels")  # what lengths of arrays follow


def has_preset_sizes(config: FdiConfig) -> bool:
    """Whether arrays are as long as in some preset, for whose lengths kernels are compiled."""
    return any(all(getattr(config, name) == getattr(preset, name) for name in SIZES) for preset in PRESETS.values())
