"""Extension beyond the paper: an attacker in closed loop, with weights found by `switching_search`."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files

import numpy as np

from baselines.rogue.memory import recalled
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray

SIGNALS = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate", "speed_excess", "one")
RATE_MPS, EXCESS_MPS = 5.0, 10.0
SIZE = len(SIGNALS) + 1  # the last weight is the hysteresis


@lru_cache(maxsize=1)
def shipped_weights() -> dict[tuple[str, float], FloatArray]:
    """The weights (7,) that come with the package, by the defender and the power ratio they were found against."""
    text = files("baselines.rogue").joinpath("switching.json").read_text(encoding="utf-8")
    return {(row["against"], row["power_ratio"]): np.array(row["weights"]) for row in json.loads(text)["found"]}


class Switching(AnalyticPolicy):
    """Full effort with the sign of a linear form in five signals, kept while the form is within a hysteresis.

    The form is w . [(gap_f - sigma)/sigma, rate_f/(5 m/s), (gap_r - sigma)/sigma, rate_r/(5 m/s), (v - v_ref)/(10 m/s),
    1]; the sign changes where it exceeds |w_7|, and is + at the start. `weights` is (7,), or (B, 7) with one set per
    episode. Without, those that the search found against a defender, or against `all`, at the nearest power ratio.

    Raises:
        ConfigurationError: `weights` has another shape, or nothing was searched against that defender.
    """

    def __init__(self, spec: RoleSpec, weights: FloatArray | None = None, against: str = "all") -> None:
        super().__init__(spec)
        if weights is None:
            self.ratios, self.sets = _found_against(against)
        else:
            self.ratios, self.sets = np.ones(1), np.asarray(weights, np.float64)
            if self.sets.shape[-1] != SIZE or self.sets.ndim > 2:
                raise ConfigurationError(f"weights of shape (7,) or (B, 7) were expected, got {self.sets.shape}")
        self.searched = weights is None

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The actions (B, 1), each -1 or 1, which are also the state (B,)."""
        sigma = self.spec.config.separation_m
        weights = self.sets
        if self.searched:
            weights = self.sets[np.argmin(np.abs(seen["power_ratio"][:, np.newaxis] - self.ratios), axis=1)]
        signals = (
            seen["front_gap_error"] / sigma,
            seen["front_gap_rate"] / RATE_MPS,
            seen["rear_gap_error"] / sigma,
            seen["rear_gap_rate"] / RATE_MPS,
            (seen["speed"] - seen["reference_speed"]) / EXCESS_MPS,
            np.ones(len(seen)),
        )
        form = np.sum(np.stack(signals, axis=1) * weights[..., :-1], axis=1)
        before = recalled(np.ones(len(seen)), seen, state)
        sign = np.where(np.abs(form) > np.abs(weights[..., -1]), np.sign(form), before)
        return sign[:, np.newaxis], (sign,)


def _found_against(defender: str) -> tuple[FloatArray, FloatArray]:
    """Power ratios (R,) and the weights (R, 7) found at them."""
    known = shipped_weights()
    rows = {ratio: weights for (name, ratio), weights in known.items() if name == defender}
    if not rows:
        names = dict.fromkeys(name for name, _ in known)
        raise ConfigurationError(
            f"no switching was searched against {defender!r}. {near(defender, names)} `cps-envs search-switching` "
            "searches against any registered defender."
        )
    return np.array(list(rows)), np.stack(list(rows.values()))
