"""Kalman filters of who lies and how: each takes some sensors for liars whose bias it estimates beside the building.

Others are those that a configuration offers, by the sensors that they use, and how noisy innovations are.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.config import of_bodies
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.kalman import LEAST_STD_C, memory, predicted_covariance
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets, zones_of_sensors


class FilterChoices:
    """How a defender names the filter that it wants.

    Raises:
        ConfigurationError: the configuration offers none.
    """

    def __init__(self, config: HvacConfig) -> None:
        sets = filter_sets(config)
        if not sets:
            raise ConfigurationError("no Kalman filters are offered here: set kalman_filters=true")
        self.member: BoolArray = membership(config, sets)  # (F, S)
        self.size: IntArray = self.member.sum(axis=1)
        self._model = len(sensor_sets(config)) + 1

    def index_of(self, wanted: BoolArray) -> IntArray:
        """The filter (B,) that uses the most of the wanted sensors (B, S) and no other."""
        fits = ~(self.member & ~wanted[:, np.newaxis]).any(axis=2)
        index: IntArray = np.where(fits, self.size, -1).argmax(axis=1)
        return index

    def choices(self, index: IntArray, seen: Seen) -> IntArray:
        """The defender's choices (B,) that name the filters of this index; the model until the window is full."""
        chosen: IntArray = np.where(seen["ready"] > 0.5, self._model + 1 + index, self._model)
        return chosen

    def of_last_choice(self, seen: Seen, otherwise: int) -> IntArray:
        """The filter (B,) that the defender followed last; `otherwise` where it followed none, or this is hidden."""
        if seen["last_choice"].shape[1] == 0:
            return np.full(len(seen), otherwise)
        last = seen["last_choice"].argmax(axis=1) - self._model - 1
        index: IntArray = np.where(last >= 0, last, otherwise)
        return index


# Forged readings without noise are smoother than a sensor can be.
MEMORY_STEPS = 30.0  # of the mean square: an hour
MOST = 9.0  # of a square, so that one large innovation is forgotten within hours


def spread_after(spread: FloatArray, innovation: FloatArray) -> FloatArray:
    """The exponentially weighted mean square of innovations in standard deviations, any shape, with the newest one.

    That of an honest sensor is 1 +- 0.18; below 0.35 it is seldom.
    """
    square = innovation * innovation
    square[square > MOST] = MOST
    renewed: FloatArray = spread + (square - spread) / MEMORY_STEPS
    return renewed


BIAS_KEPT = 0.9995  # of a bias at each step: estimates of what nobody measures stay bounded
BOLD_C = 1.0  # per step, of the bias of a bold liar: it may be anything


class Beliefs(NamedTuple):
    """What a defender believes of attacks before it has seen any."""

    onset_per_h: float  # 1/h, how often an attack begins while there is none
    further_liar: float  # how many times as likely as a set of liars is one with a liar more
    growth_c_per_h: float  # C/h, standard deviation of how fast the bias of a slow liar grows
    growth_h: float  # h, for how long it grows like that
    walk_c: float  # C per step, standard deviation of what else happens to that bias
    bold: float  # how many times as likely as slow liars are those whose bias may jump
    still: float  # the same for those who show little noise
    still_noise: float  # how much noise they show, as a share of an honest sensor's
    still_walk_c: float  # C per step, standard deviation of what happens to their bias
    change_per_h: float  # 1/h, how often liars turn from slow to bold or still, or back
    heat_w: float  # W, standard deviation of the drifting heat
    trust: float  # power of the likelihood: below 1 where the model is not to be trusted to the letter
    too_cold: float  # how many times as bad as one that is too warm is an estimate that is too cold: it overheats
    together: float = 0.0  # correlation of how the biases of several slow liars grow: they have one aim


START = Beliefs(
    onset_per_h=0.05,
    further_liar=0.7,
    growth_c_per_h=0.8,
    growth_h=10.0,
    walk_c=0.01,
    bold=0.3,
    still=0.3,
    still_noise=0.2,
    still_walk_c=0.05,
    change_per_h=0.3,
    heat_w=90.0,
    trust=1.0,
    too_cold=3.0,
)


class HypothesisTables(NamedTuple):
    """Tables of H hypotheses of n zones and S sensors: nobody lies, then each set of liars: slow, bold and still.

    The state of a hypothesis is x (n,) C, heat (n,) W, biases (S,) C and how fast they grow (S,) C per step.
    """

    gain: FloatArray  # (H, 2n + 2S, S)
    whiten: FloatArray  # (H, S, S) lower triangles that turn innovations, C, into independent ones of variance 1
    offset: FloatArray  # (H,) of the logarithm of the density
    lies: FloatArray  # (H, S) 1 for a liar
    prior: FloatArray  # (H,) of the attack that begins; 0 for the first hypothesis
    growth_kept: FloatArray  # () of the growth at each step
    kinds: FloatArray  # (3,) shares of the kinds
    onset: FloatArray  # () probability that an attack begins, at each step
    change: FloatArray  # () probability that liars may turn to another kind, at each step
    trust: FloatArray  # ()
    too_cold: FloatArray  # ()


def liar_sets(config: HvacConfig) -> BoolArray:
    """Who lies (L, S): nobody, then the complements of the sets of sensors that have a Kalman filter.

    Not all sensors at once, but where there is one only.
    """
    honest = membership(config, filter_sets(config))
    count, least = honest.sum(axis=1), min(1, config.num_sensors - 1)
    some: BoolArray = ~honest[(count >= least) & (count < config.num_sensors)]
    return np.concatenate([np.zeros((1, config.num_sensors), np.bool_), some])


@lru_cache(maxsize=64)
def hypotheses(config: HvacConfig, beliefs: Beliefs) -> HypothesisTables:
    """The filters that follow from what a defender believes."""
    sets = liar_sets(config)
    kinds = (  # odds, what happens to the bias at each step in C, share of the noise
        (1.0, beliefs.walk_c, 1.0),
        (beliefs.bold, BOLD_C, 1.0),
        (beliefs.still, beliefs.still_walk_c, beliefs.still_noise),
    )
    liars = [(sets[0], 0.0, 0.0, 1.0), *((who, *kind) for who in sets[1:] for kind in kinds)]
    odds = np.array([kind[0] for kind in kinds])
    kept = float(np.exp(-config.step_s / (3600.0 * beliefs.growth_h)))
    growth_c = beliefs.growth_c_per_h * config.step_s / 3600.0 * np.sqrt(1.0 - kept**2)
    filters = [_filter(config, beliefs, who, walk_c, growth_c, kept, noise) for who, _, walk_c, noise in liars]
    gain, whiten, offset = (np.array(part) for part in zip(*filters, strict=True))
    prior = np.array([likely * beliefs.further_liar ** who.sum() for who, likely, _, _ in liars])
    return HypothesisTables(
        gain=gain,
        whiten=whiten,
        offset=offset,
        lies=np.array([who for who, *_ in liars], np.float64),
        prior=prior / prior.sum(),
        growth_kept=np.array(kept),
        kinds=odds / odds.sum(),
        onset=np.array(min(beliefs.onset_per_h * config.step_s / 3600.0, 0.5)),
        change=np.array(min(beliefs.change_per_h * config.step_s / 3600.0, 0.5)),
        trust=np.array(beliefs.trust),
        too_cold=np.array(beliefs.too_cold),
    )


def _filter(
    config: HvacConfig, beliefs: Beliefs, who: BoolArray, walk_c: float, growth_c: float, kept: float, noise: float
) -> tuple[FloatArray, FloatArray, float]:
    """Gain, whitening triangle and offset of one hypothesis, stationary."""
    building, zone = discretise(config), zones_of_sensors(config)
    n, S, phi = config.num_zones, config.num_sensors, memory(config)
    F = np.zeros((2 * n + 2 * S, 2 * n + 2 * S))
    F[:n, :n], F[:n, n : 2 * n], F[n : 2 * n, n : 2 * n] = building.A, np.diag(building.B), phi * np.eye(n)
    bias, growth = slice(2 * n, 2 * n + S), slice(2 * n + S, None)
    F[bias, bias], F[bias, growth], F[growth, growth] = BIAS_KEPT * np.eye(S), np.eye(S), kept * np.eye(S)
    changes = (np.zeros(n), np.full(n, (1.0 - phi**2) * beliefs.heat_w**2), who * walk_c**2, who * growth_c**2)
    Q = np.diag(np.concatenate(changes))
    Q[growth, growth] += beliefs.together * growth_c**2 * np.outer(who, who) * ~np.eye(S, dtype=np.bool_)
    C = np.hstack([np.eye(n)[zone], np.zeros((S, n)), np.diag(who.astype(np.float64)), np.zeros((S, S))])
    R = np.diag(np.maximum(of_bodies(config.noise_std_c, S), LEAST_STD_C) ** 2 * np.where(who, noise**2, 1.0))
    P = predicted_covariance(F, C.T @ np.linalg.solve(R, C), Q)
    covariance = C @ P @ C.T + R
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    gain: FloatArray = P @ C.T @ (whiten.T @ whiten)
    return gain, whiten, float(np.log(np.diag(whiten)).sum())
