"""What `cps-envs oracle --episodes` has certified about evaluation episodes, as metrics of these episodes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from agents.errors import CommandError
from cps_envs.core.types import FloatArray


def stored_episodes(path: Path, config: Any) -> dict[str, Any]:
    """The certified episodes of a file, by seed; none where there is no file.

    Raises:
        CommandError: it holds something else, or another configuration.
    """
    if not path.exists():
        return {}
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        same, rows = stored["config"] == plain_values(config), dict(stored["episodes"])
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise CommandError(f"{path} holds no certified episodes. Name another file with --out.") from error
    if not same:
        raise CommandError(
            f"{path} holds episodes of another configuration. Name another file with --out, or delete it."
        )
    return rows


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
        "optimum_proved": np.array([float(row["status"] == "proved") for row in chosen]),
    }


def plain_values(config: Any) -> Any:
    """A configuration as the file has it."""
    return json.loads(json.dumps(asdict(config)))
