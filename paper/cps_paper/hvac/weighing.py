"""`python -m cps_paper.hvac.weighing` finds the weight R of moves for each controller and horizon N.

R is what gives the paper's A_impact of its one printed attack (C12: sensor 1 reads 22 C). N is then free: the rows show
what the errors on raw readings in Table 4.1 would be. It takes a few minutes.

The noise of Table 4.1 is read as a variance; part `deviation` of `cps-envs reproduce ch4` has the other reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.hvac.deviation import printed_errors_c
from cps_paper.hvac.experiments import PERCENTS
from cps_paper.hvac.scenario import DayScenario

PRINTED_C2 = 149.253
DAYS = 4
STEPS = 14  # of the search, each of which halves the logarithm's range
LOWEST, HIGHEST = 1e-6, 4.0  # C2/W2, between which R lies
HORIZONS = {"clip": (20, 40, 60, 80), "qp": (10, 15, 20, 22, 25, 28, 30, 40), "levels": (15, 20, 22, 25, 28, 30, 40)}


def impact_c2(settings: Mapping[str, Any]) -> float:
    """The mean A_impact while sensor 1 reads 22 C, without a defence."""
    attack = {"attack_order": (1,), "num_compromised": 1}
    return float(_days("constant", {**settings, **attack}).run().a_impact.mean())


def weight(settings: Mapping[str, Any]) -> float:
    """The R with the paper's impact: the impact falls with R, so that halving finds it."""
    low, high = np.log(LOWEST), np.log(HIGHEST)
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        if impact_c2({**settings, "move_weight": float(np.exp(middle))}) > PRINTED_C2:
            low = middle
        else:
            high = middle
    return float(np.exp(0.5 * (low + high)))


def raw_errors_c(settings: Mapping[str, Any]) -> FloatArray:
    """Table 4.1 without a defence: the mean errors over zones and days for each variance of the noise, (4,) C."""
    scenarios = [_days("none", {**settings, "noise_std_c": (share / 100.0) ** 0.5}) for share in PERCENTS["4.1"]]
    return np.array([each.run().mean_abs_error_c.mean() for each in scenarios])


def main() -> None:
    """Print a row for each controller and horizon."""
    printed = np.array(printed_errors_c())
    shares = ", ".join(map(str, PERCENTS["4.1"]))
    print(f"| controller | N | R, C2/W2 | A_impact of C12 | mean errors at {shares} %, C | mean gap |")
    print("|---|---|---|---|---|---|")
    print(f"| paper | - | - | {PRINTED_C2} | {_shown(printed)} | - |")
    for controller, horizons in HORIZONS.items():
        for steps in horizons:
            settings: dict[str, Any] = {"controller": controller, "prediction_steps": steps}
            settings["move_weight"] = weight(settings)
            ours, impact = raw_errors_c(settings), impact_c2(settings)
            gap = np.abs(ours - printed).mean()
            row = f"{settings['move_weight']:.3g} | {impact:.1f} | {_shown(ours)} | {gap:.2f}"
            print(f"| {controller} | {steps} | {row} |", flush=True)


def _days(attacker: str, settings: Mapping[str, Any]) -> DayScenario:
    return DayScenario(attacker, "none", DAYS, tuple(sorted(settings.items())))


def _shown(values: FloatArray) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


if __name__ == "__main__":
    main()
