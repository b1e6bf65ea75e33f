"""What `cps-envs oracle --episodes` has certified about evaluation episodes, as metrics of these episodes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.errors import CommandError
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import FloatArray
from cps_envs.fdi.optima import FASTEST_MPS, PROVED, ROUNDING_MPS, STATUSES


def stored_episodes(path: Path, config: Any) -> dict[str, Any]:
    """The certified episodes of a file, by seed; none where there is no file.

    Raises:
        DamagedFileError: it holds something else.
        CommandError: it holds episodes of another configuration.
    """
    if not path.exists():
        return {}
    document = read_entry(path, "file of certified episodes", "Name another file with --out, or delete it.")
    same, rows = document["config"].value == plain_values(config), document["episodes"].entries()
    if not same:
        raise CommandError(
            f"{path} holds episodes of another configuration. Name another file with --out, or delete it."
        )
    for row in rows.values():
        _check(row)
    return document["episodes"].plain()


def certified_metrics(path: Path, config: Any, episodes: int) -> Mapping[str, FloatArray]:
    """Bound and best known value (m/s) of the evaluation episodes, and 1 where an attack is proved optimal.

    Each is (episodes,); the value is 0 where no attack is known.

    Raises:
        CommandError: the file does not have them all.
    """
    rows = stored_episodes(path, config)
    if missing := [seed for seed in range(episodes) if str(seed) not in rows]:
        raise CommandError(
            f"{path} lacks {len(missing)} of {episodes} episodes: certify them with `cps-envs oracle --episodes "
            f"{episodes} --out {path}`, with the same preset and settings."
        )
    chosen = [rows[str(seed)] for seed in range(episodes)]
    return {
        "oracle_bound_mps": np.array([row["bound_mps"] for row in chosen]),
        "oracle_value_mps": np.array([row["value_mps"] or 0.0 for row in chosen]),
        "optimum_proved": np.array([float(row["status"] == PROVED) for row in chosen]),
    }


def _check(row: Entry) -> None:
    """That a row has what is read from it, as `cps-envs oracle --episodes` wrote it."""
    row["task"].text()
    row["status"].text(STATUSES)
    row["wall_s"].number(0)
    bound_mps = row["bound_mps"].number(0, FASTEST_MPS)
    if row["value_mps"].value is not None:
        row["value_mps"].number(0, bound_mps + ROUNDING_MPS)
    if row["lp_mps"].value is not None:
        row["lp_mps"].number(0, FASTEST_MPS)
    for gain in row["gains"].rows():
        gain.number()


def plain_values(config: Any) -> Any:
    """A configuration as the file has it."""
    return json.loads(json.dumps(asdict(config)))
