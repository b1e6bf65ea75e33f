"""`python -m cps_paper.hvac.weighing` finds the weight R of moves for each controller and horizon N.

R is what gives the paper's A_impact of its one printed attack (C12: sensor 1 reads 22 C). N is then free: the rows show
what the errors on raw readings in Table 4.1 would be. It takes a few minutes.

With `deviation` the noise of Table 4.1 is read as a standard deviation, with other R. The last columns judge both: the
errors of the raw readings, and C12.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.hvac.experiments import PERCENTS
from cps_paper.hvac.scenario import DayScenario
from cps_paper.printed.tables import tracking_errors
from cps_paper.verdicts import NEAR, NOT, REPRODUCED, of_number

PRINTED_C2 = 149.253
DAYS = 4
STEPS = 14  # of the search, each of which halves the logarithm's range
LOWEST, HIGHEST = 1e-6, 4.0  # C2/W2, between which R lies
HORIZONS = {"clip": (20, 40, 60, 80), "qp": (10, 15, 20, 22, 25, 28, 30, 40), "levels": (15, 20, 22, 25, 28, 30, 40)}


VARIANCE, DEVIATION = 0.5, 1.0  # readings of the "20 to 80 %" of Table 4.1: the power that gives a standard deviation
CLOSEST = (("clip", 60, 0.05), ("clip", 80, 0.25), ("clip", 120, 0.25))  # controller, N, R near it as a deviation


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


def raw_errors_c(settings: Mapping[str, Any], power: float = VARIANCE) -> FloatArray:
    """Table 4.1 without a defence: the mean errors over zones and days for each share of noise, (4,) C.

    The standard deviation, C, is the share to this power.
    """
    scenarios = [_days("none", {**settings, "noise_std_c": (share / 100.0) ** power}) for share in PERCENTS["4.1"]]
    return np.array([each.run().mean_abs_error_c.mean() for each in scenarios])


def printed_errors_c() -> FloatArray:
    """The same as printed."""
    cells = [cell for cell in tracking_errors("4.1") if cell.sensors_used == 0]
    return np.array(
        [np.mean([cell.mean_abs_error_c for cell in cells if cell.percent == share]) for share in PERCENTS["4.1"]]
    )


def main() -> None:
    """Print a row for each controller and horizon, or those with the noise as a standard deviation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("noise", nargs="?", choices=("variance", "deviation"), default="variance")
    noise = parser.parse_args().noise
    printed = printed_errors_c()
    shares = ", ".join(map(str, PERCENTS["4.1"]))
    print(f"| controller | N | R, C2/W2 | A_impact of C12 | mean errors at {shares} %, C | mean gap | errors | C12 |")
    print("|---|---|---|---|---|---|---|---|")
    print(f"| paper | - | - | {PRINTED_C2} | {_shown(printed)} | - | - | - |")
    for controller, steps, given in CLOSEST if noise == "deviation" else _searched():
        settings: dict[str, Any] = {"controller": controller, "prediction_steps": steps}
        settings["move_weight"] = given or weight(settings)
        ours = raw_errors_c(settings, DEVIATION if noise == "deviation" else VARIANCE)
        impact = impact_c2(settings)
        cells = f"{settings['move_weight']:.3g} | {impact:.1f} | {_shown(ours)} | {np.abs(ours - printed).mean():.2f}"
        print(f"| {controller} | {steps} | {cells} | {' | '.join(judged(ours, printed, impact))} |", flush=True)


def judged(ours: FloatArray, printed: FloatArray, impact: float) -> tuple[str, str]:
    """The verdict on each mean error as "reproduced 1, near 2, ...", and that on C12."""
    verdicts = Counter(of_number(*pair) for pair in zip(ours.tolist(), printed.tolist(), strict=True))
    errors = ", ".join(f"{verdict} {verdicts[verdict]}" for verdict in (REPRODUCED, NEAR, NOT) if verdicts[verdict])
    return errors, of_number(impact, PRINTED_C2)


def _searched() -> Iterator[tuple[str, int, None]]:
    """Controllers and horizons, whose R is what gives C12."""
    return ((controller, steps, None) for controller, horizons in HORIZONS.items() for steps in horizons)


def _days(attacker: str, settings: Mapping[str, Any]) -> DayScenario:
    return DayScenario(attacker, "none", DAYS, tuple(sorted(settings.items())))


def _shown(values: FloatArray) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


if __name__ == "__main__":
    main()
