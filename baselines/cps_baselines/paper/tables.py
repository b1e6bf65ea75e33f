"""Reading the printed tables."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

from cps_envs.core.errors import UnknownNameError, near


@dataclass(frozen=True)
class VelocityErrorCell:
    """One cell of Table 2.2 or 2.3."""

    desired_gap_m: float
    tau_s: float
    controller: str  # baseline, heuristic or mpc
    velocity_error_percent: float
    crash: bool


def read_table(name: str) -> list[dict[str, str]]:
    """The rows of a table such as "table_2_2", as printed.

    Raises:
        UnknownNameError: there is no such table.
    """
    folder = files("cps_baselines.paper")
    known = [entry.name.removesuffix(".csv") for entry in folder.iterdir() if entry.name.endswith(".csv")]
    if name not in known:
        raise UnknownNameError(f"there is no table {name!r} of the paper. {near(name, known)}")
    text = folder.joinpath(f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def velocity_errors(name: str) -> list[VelocityErrorCell]:
    """The cells of "table_2_2" or "table_2_3"."""
    return [
        VelocityErrorCell(
            desired_gap_m=float(row["desired_gap_m"]),
            tau_s=float(row["tau_s"]),
            controller=row["controller"],
            velocity_error_percent=float(row["velocity_error_percent"]),
            crash=row["crash"] == "yes",
        )
        for row in read_table(name)
    ]
