"""Fig. 4.5: how far the observer is off with few sensors and short windows."""

from __future__ import annotations

from cps_baselines.hvac.reproduction.experiments import Case, observed
from cps_baselines.reproduction.evidence import Evidence
from cps_envs.core.types import FloatArray


def largest_errors_c(evidence: Evidence, case: Case) -> FloatArray:
    """The largest |xh - x| of each day and zone (B, n), C, once the window is full."""
    course = evidence[observed(*case)]
    largest: FloatArray = course.estimation_error_c[course.config.window_steps :].max(axis=0)
    return largest


def start_h(evidence: Evidence, case: Case) -> float:
    """When the estimation starts, h."""
    config = evidence[observed(*case)].config
    return config.window_steps * config.step_s / 3600.0
