"""What a picture of the building shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.declare.config import over_time, series_in
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import Model
from cps_envs.hvac.sensors import membership
from cps_envs.hvac.state import State


@dataclass(frozen=True)
class Day:
    """The series of an episode, of its K states; empty what is no series."""

    outdoor_c: FloatArray  # (K or 0,) C, as forecast
    reference_c: FloatArray  # (K or 0, n) C


@dataclass(frozen=True)
class Scene:
    """One episode at one step; n zones, S sensors, sets of sensors."""

    config: HvacConfig
    episode: int  # differs between the episodes of a game
    step: int  # k
    onset: int  # t_0
    temperature: FloatArray  # (n,) C, true
    estimate: FloatArray  # (n,) C, that the controller got one step ago
    heating: FloatArray  # (n,) W, of the last step, as commanded
    supplied: FloatArray  # (n,) W, what the zones got of it
    shift: FloatArray  # (n,) C, by which the set-points were moved that the controller heard
    denied: BoolArray  # (2,) readings that did not arrive now, commands one step ago
    reference_c: FloatArray  # (n,) C, set-points now
    day: Day
    ground_c: float  # now
    outdoor_c: float  # now
    forecast_c: float  # what everybody expects of it
    unknown_heat: FloatArray  # (n,) W, that nobody measures, now
    believed_heat: FloatArray  # (n,) W, by the filter that the controller followed one step ago; nan without one
    measured: FloatArray  # (S,) C, before forging
    reading: FloatArray  # (S,) C, after forging
    compromised: BoolArray  # (S,)
    choice: int  # of the defender one step ago: 0 raw readings, 1.. sets, the model, Kalman filters, thermostats
    ready: bool  # the window is full
    residual: FloatArray  # (sets,) C2, J_a(k)
    mean_residual: FloatArray  # (sets,) C2, Jm_a(k); 0 until ready
    metrics: dict[str, float]

    @property
    def member(self) -> BoolArray:
        """Which sensors each set has, (sets, S)."""
        return membership(self.config)

    @property
    def flawed(self) -> BoolArray:
        """Which sets (sets,) have a compromised sensor."""
        return np.asarray((self.member & self.compromised).any(axis=1))

    @property
    def impact(self) -> float:
        """A_impact so far, C2."""
        return self.metrics["a_impact"]

    @property
    def last_step(self) -> int:
        """The step at which the episode ends."""
        return self.config.num_steps - 1


def scene_of(config: HvacConfig, state: State, model: Model, b: int, episode: int, metrics: dict[str, float]) -> Scene:
    """Episode `b` of a batch at its present step."""
    k, window, n = int(state.step[b]), len(model.decay) - 1, len(model.B)
    first, shown = int(state.first[b]), series_in(config)
    now, whole = first + k, slice(first, first + config.num_steps)
    ground = over_time(config, "ground_c", np.array([float(model.begin_s) + now * config.step_s]), 1)
    drift, error = state.heat_drift[b], state.outdoor_error[b]
    followed, filters = int(state.choice[b]) - len(model.member) - 2, len(model.filter_member)
    return Scene(
        config=config,
        episode=episode,
        step=k,
        onset=int(state.onset[b]),
        temperature=state.temperature[b].copy(),
        estimate=state.fed[b].copy(),
        heating=state.heating[b].copy(),
        supplied=state.supplied[b].copy(),
        shift=state.shift[b].copy(),
        denied=state.denied[b].copy(),
        reference_c=model.reference[now].copy(),
        day=Day(
            model.outdoor[whole if "outdoor_c" in shown else slice(0)],
            model.reference[whole if "reference_c" in shown else slice(0)],
        ),
        ground_c=float(ground[0, 0]),
        outdoor_c=float(model.outdoor[now] + (error[k] if len(error) else 0.0)),
        forecast_c=float(model.outdoor[now]),
        unknown_heat=state.heat[b] + (drift[k] if len(drift) else 0.0),
        believed_heat=state.filtered[b, followed, n:].copy() if 0 <= followed < filters else np.full(n, np.nan),
        measured=state.measured[b].copy(),
        reading=state.reading[b].copy(),
        compromised=state.compromised[b].copy(),
        choice=int(state.choice[b]),
        ready=k >= window,
        residual=state.residual[b].copy(),
        mean_residual=state.mean_residual[b].copy(),
        metrics=metrics,
    )
