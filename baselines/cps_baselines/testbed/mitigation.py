"""The mitigation of section 2.5 as the robots run it: the heuristic with the test bed's fineness."""

from __future__ import annotations

from cps_envs.testbed.config import RobotConfig

DECREMENT_MPS2 = 0.02  # in the robots' metres; chosen
PERIODS_S = (0.5, 1.0)  # t_s of Figs. 2.5b and c


def mitigation(period_s: float, config: RobotConfig) -> str:
    """The name of the heuristic with t_s = `period_s`, samples of a control period, and bodies that have a length."""
    options = {
        "horizon_s": period_s,
        "sample_s": config.control_period_s,
        "decrement_mps2": config.scale * DECREMENT_MPS2,
        "clearance_m": config.scale * config.body_length_m,
        "avoidance": str(config.avoidance == "always").lower(),
    }
    return "heuristic?" + "&".join(f"{name}={value}" for name, value in options.items())
