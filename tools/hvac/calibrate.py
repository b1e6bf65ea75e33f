"""`python -m tools.hvac.calibrate`: the threshold eps of the HVAC defender `mtd2`, from attack-free days."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from cps_agents.commands.options import AsJson, Changes
from cps_agents.console import assignments, note, out, print_json
from cps_agents.files import write_json
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_baselines.hvac.calibrated import DEFENDER, HARD, MARGIN, SEEDS, SETTLING_STEPS, Calibration, calibrate
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import SensorSet, sensor_sets
from tools.command import run

DIGITS = 6


class Level(NamedTuple):
    """A preset with overrides, for which the threshold of MTD2 is calibrated."""

    preset: str
    overrides: Mapping[str, Any]

    @property
    def config(self) -> HvacConfig:
        """The configuration that they name."""
        config: HvacConfig = HVAC.config(self.preset, self.overrides)
        return config


SHIPPED = tuple(
    Level(preset, {"num_sensors": sensors, **mismatch})
    for preset, mismatch in (("paper", {}), ("easy", {}), ("easy", HARD))
    for sensors in (4, 8)
)


def calibrate_mtd2(
    preset: Annotated[str, typer.Option(help="Start from this preset.")] = "paper",
    overrides: Changes = None,
    num_seeds: Annotated[int, typer.Option("--seeds", min=1, help="Play so many days, on seeds 1000, 1001, ...")] = 5,
    to: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.json", help="Also write the JSON to this file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the threshold eps of the HVAC defender `mtd2` from days without an attack.

    eps is 1.2 times the largest mean residual of any set, from 20 samples on. Without --preset and --set the command
    computes it for the configurations whose eps comes with the package.
    """
    seeds = range(SEEDS[0], SEEDS[0] + num_seeds)
    own = preset != "paper" or overrides
    levels = (Level(preset, assignments(overrides or [])),) if own else SHIPPED
    found = _calibrate(levels, seeds)
    document = _document(found, seeds)
    if to is not None:
        write_json(to, document)
    if as_json:
        print_json(document)
    else:
        _print(found, seeds)
    if to is not None:
        note(f"Written: {to}")


def _calibrate(levels: tuple[Level, ...], seeds: range) -> list[tuple[Level, Calibration]]:
    total, done = sum(level.config.num_steps for level in levels), 0
    found = []
    with Progress("steps", total) as progress:
        for level in levels:

            def report(step: int, done: int = done) -> None:
                progress.update(done + step)

            found.append((level, calibrate(level.config, seeds, report=report)))
            done += level.config.num_steps
    return found


def _document(found: list[tuple[Level, Calibration]], seeds: range) -> dict[str, Any]:
    return {
        "margin": MARGIN,
        "settling_steps": SETTLING_STEPS,
        "defender": DEFENDER,
        "seeds": list(seeds),
        "levels": [
            {
                "preset": level.preset,
                "overrides": dict(level.overrides),
                "threshold_c2": round(calibration.threshold_c2, DIGITS),
                "configured_c2": level.config.threshold_c2,
                "largest_set": list(deciding(calibration)),
                "rejecting_share": calibration.rejecting_share.round(DIGITS),
            }
            for level, calibration in found
        ],
    }


def _print(found: list[tuple[Level, Calibration]], seeds: range) -> None:
    columns = ("configuration", "eps, C2", "decided by", "eps now", "rejects all")
    rows = [
        (
            _name(level),
            f"{calibration.threshold_c2:.3f}",
            ", ".join(f"s{sensor}" for sensor in deciding(calibration)),
            f"{level.config.threshold_c2:g}",
            f"{calibration.rejecting_share.mean():.1%}",
        )
        for level, calibration in found
    ]
    title = f"eps of MTD2 from {len(seeds)} attack-free days, seeds {seeds[0]} to {seeds[-1]}"
    console = out()
    console.print(Sheet(title, columns, rows))
    console.print(
        "rejects all: steps with a full window in which no set passes the eps that the configuration has now."
    )


def deciding(calibration: Calibration) -> SensorSet:
    """The sensors of the set with the largest mean residual, which decides the threshold."""
    return sensor_sets(calibration.config)[int(calibration.largest_c2.max(axis=0).argmax())]


def _name(level: Level) -> str:
    return ", ".join(
        [
            level.preset,
            *(
                f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
                for name, value in level.overrides.items()
            ),
        ]
    )


if __name__ == "__main__":
    run(calibrate_mtd2, "python -m tools.hvac.calibrate")
