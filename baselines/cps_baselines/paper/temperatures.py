"""Reading Tables 4.1 and 4.2: how far the rooms are from their reference temperature."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cps_baselines.paper.tables import read_table


@dataclass(frozen=True)
class TrackingErrorCell:
    """One cell of Table 4.1 or 4.2: the mean absolute tracking error e_i of a zone."""

    table: str  # "4.1" or "4.2"
    percent: int  # variance of the measurement noise in 0.01 C2 (4.1), range of the perturbation of A (4.2)
    sensors_used: int  # by the estimate; 0: the controller gets the measurements
    zone: int  # from 1
    mean_abs_error_c: float


def tracking_errors(table: str) -> list[TrackingErrorCell]:
    """The cells of Table "4.1" or "4.2", row by row as printed.

    Raises:
        UnknownNameError: there is no such table.
    """
    return [
        TrackingErrorCell(
            table,
            percent=_percent(row["condition"]),
            sensors_used=0 if row["source"] == "raw" else int(row["sensors_used"]),
            zone=int(row["zone"]),
            mean_abs_error_c=float(row["mean_abs_error_c"]),
        )
        for row in read_table(f"table_{table.replace('.', '_')}")
    ]


def _percent(condition: str) -> int:
    (number,) = re.findall(r"(\d+)%", condition)
    return int(number)
