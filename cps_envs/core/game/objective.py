"""What the attacker is paid where a configuration says so: weights of metrics, or a function of their increments."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from cps_envs.core.declare.objective import FIELD, PayFunction, Weights, weights_of
from cps_envs.core.errors import ConfigurationError, UnknownNameError, near, shown
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import Array, BoolArray, FloatArray


class Objective:
    """Pays B episodes for the growth of their metrics, which at the start of an episode counts from 0.

    With weights the return is the weighted sum of the metrics at the end of the episode. `before` (B, k) is what the k
    metrics were that count, at the last payment.
    """

    def __init__(self, paid: Weights | PayFunction, metrics: Mapping[str, Array]) -> None:
        """`metrics` (B,) are those that the game measures.

        Raises:
            ConfigurationError: a weight is of something that is none of them.
        """
        self.weights: Weights = () if callable(paid) else paid
        self.function: PayFunction | None = paid if callable(paid) else None
        for name, _ in self.weights:
            if name not in metrics:
                raise ConfigurationError(
                    f"{FIELD}: there is no metric {name!r} in this configuration. {near(name, metrics)}"
                )
        self._names = tuple(metrics) if callable(paid) else tuple(name for name, _ in self.weights)
        self._weight = np.array([weight for _, weight in self.weights])
        num_envs = len(next(iter(metrics.values())))
        self.before: FloatArray = np.zeros((num_envs, len(self._names)))

    def begin(self, envs: BoolArray) -> None:
        """Follow a reset of the marked episodes (B,)."""
        self.before[envs] = 0.0

    def pay(self, metrics: Mapping[str, Array], envs: BoolArray) -> FloatArray:
        """What the attacker is paid (B,) since the last call; nothing in episodes that are not marked (B,).

        Raises:
            ConfigurationError: a metric that is paid is not finite yet, or the function does not return finite
                numbers (B,).
        """
        now = np.stack([np.asarray(metrics[name], np.float64) for name in self._names], axis=1)
        grown = np.where(envs[:, np.newaxis], now - self.before, 0.0)
        self.before[envs] = now[envs]
        if self.function is None:
            if not np.isfinite(grown).all():
                name = self._names[int(np.flatnonzero(~np.isfinite(grown).all(axis=0))[0])]
                raise ConfigurationError(f"{FIELD}: the metric {name!r} is not finite yet, so it cannot be paid")
            paid: FloatArray = grown @ self._weight
            return paid
        return np.where(envs, self._called(dict(zip(self._names, grown.T, strict=True))), 0.0)

    def _called(self, increments: dict[str, FloatArray]) -> FloatArray:
        assert self.function is not None
        count = len(self.before)
        try:
            paid = np.asarray(self.function(increments), np.float64)
        except KeyError as error:
            name = str(error.args[0]) if error.args else ""
            raise ConfigurationError(f"{FIELD}: there is no metric {name!r}. {near(name, increments)}") from error
        except Exception as error:
            raise ConfigurationError(f"{FIELD}: the function failed: {type(error).__name__}: {error}") from error
        if paid.shape != (count,) or not np.isfinite(paid).all():
            raise ConfigurationError(
                f"{FIELD}: the function must return {count} finite numbers, one for each environment, and returned "
                f"{shown(paid)}"
            )
        return paid

    @property
    def formula(self) -> str:
        """What is paid in words, such as `a_impact + 0.1 energy_kwh`."""
        if self.function is not None:
            return f"{getattr(self.function, '__name__', 'a function')}(increments of the metrics)"
        return " + ".join(name if weight == 1 else f"{weight:g} {name}" for name, weight in self.weights)


def objective_of(config: Any, metrics: Mapping[str, Array]) -> Objective | None:
    """What a configuration pays, of a game with these metrics (B,); None where the game's own payoff is paid.

    Raises:
        ConfigurationError: there is no such metric, or what a text names is no function.
        UnknownNameError: nothing can be imported from such a text.
        UntrustedCodeError: it names code that the user has not agreed to run, see `cps_envs.trust`.
    """
    paid = weights_of(config)
    if paid is None:
        return None
    return Objective(_imported(paid) if isinstance(paid, str) else paid, metrics)


def _imported(text: str) -> PayFunction:
    require_trust(text)
    module, _, attribute = text.partition(":")
    try:
        found: Any = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(f"{FIELD}: no function can be imported from {text!r}: {error}") from error
    if not callable(found):
        raise ConfigurationError(f"{FIELD}: {text!r} is no function but {shown(found)}")
    function: PayFunction = found
    return function
