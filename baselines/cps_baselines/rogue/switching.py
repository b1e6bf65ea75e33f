"""Extension beyond the paper: an attacker in closed loop, with weights that a search found: `switching.json`."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files

import numpy as np

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Observation, State
from cps_envs.rogue.reading import nearest, read

SIGNALS = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate", "speed_excess", "one")
RATE_MPS, EXCESS_MPS = 5.0, 10.0
SIZE = len(SIGNALS) + 1  # the last weight is the hysteresis


@lru_cache(maxsize=1)
def shipped_weights() -> dict[tuple[str, float], FloatArray]:
    """The weights (7,) that come with the package, by the defender and the power ratio they were found against."""
    text = files("cps_baselines.rogue").joinpath("switching.json").read_text(encoding="utf-8")
    return {(row["against"], row["power_ratio"]): np.array(row["weights"]) for row in json.loads(text)["found"]}


class Switching(AnalyticPolicy):
    """Drives or brakes fully, by the sign of a linear form in five signals, with a hysteresis.

    The form is w . [(gap_f - sigma)/sigma, rate_f/(5 m/s), (gap_r - sigma)/sigma, rate_r/(5 m/s), (v - v_ref)/(10 m/s),
    1]; the sign changes where it exceeds |w_7|, and is + at the start. Of several seized vehicles each goes by its own
    signals. `weights` is (7,), or (B, 7) with one set per
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
        self._by_ratio = weights is None
        self.searched_numbers = self.sets.size if self._by_ratio else 0

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, seats), each -1 or 1, which are also the state."""
        first = np.ones((len(seen), *self.spec.neutral_action.shape))
        sign = first if state is None else np.where(seen.start[:, np.newaxis], first, state[0])
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        _switch(*shown, self.spec.config.separation_m, self.ratios, np.atleast_2d(self.sets), self._by_ratio, sign)
        return sign.copy(), (sign,)


def switch(seen: Seen, separation_m: float, weights: FloatArray, sign: FloatArray) -> FloatArray:
    """The signs (B,) after those of the last decision, by weights (B, 7)."""
    signs, shown = sign[:, np.newaxis].copy(), (seen.observation, seen.fields.offsets, seen.fields.scale)
    _switch(*shown, separation_m, np.ones(1), weights, False, signs)
    return signs[:, 0]


@kernel
def _switch(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    separation_m: float,
    ratios: FloatArray,
    sets: FloatArray,
    by_ratio: bool,
    sign: FloatArray,
) -> None:
    """Bring the signs (B, seats) of the last decision up to date."""
    at = offsets[0]
    for b in range(sign.shape[0]):
        row = nearest(ratios, read(observation, scale, b, at.power_ratio)) if by_ratio else b % sets.shape[0]
        weights = sets[row]
        for seat in range(sign.shape[1]):
            form = weights[0] * (read(observation, scale, b, at.front_gap_error + seat) / separation_m)
            form += weights[1] * (read(observation, scale, b, at.front_gap_rate + seat) / RATE_MPS)
            form += weights[2] * (read(observation, scale, b, at.rear_gap_error + seat) / separation_m)
            form += weights[3] * (read(observation, scale, b, at.rear_gap_rate + seat) / RATE_MPS)
            excess = read(observation, scale, b, at.speed + seat) - read(observation, scale, b, at.reference_speed)
            form += weights[4] * (excess / EXCESS_MPS)
            form += weights[5]
            if abs(form) > abs(weights[6]):
                sign[b, seat] = np.sign(form)


def _found_against(defender: str) -> tuple[FloatArray, FloatArray]:
    """Power ratios (R,) and the weights (R, 7) found at them."""
    known = shipped_weights()
    rows = {ratio: weights for (name, ratio), weights in known.items() if name == defender}
    if not rows:
        names = dict.fromkeys(name for name, _ in known)
        raise ConfigurationError(
            f"no switching was searched against {defender!r}. {near(defender, names)} `cps-envs best-response "
            "--oracle search` searches against any registered defender."
        )
    return np.array(list(rows)), np.stack(list(rows.values()))
