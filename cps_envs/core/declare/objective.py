"""What the attacker is paid as a field of a configuration: a word, weights of metrics, or a function of them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from cps_envs.core.errors import ConfigurationError, near, shown
from cps_envs.core.types import FloatArray

Increments: TypeAlias = Mapping[str, FloatArray]  # of all metrics in a game step, each (B,)
PayFunction: TypeAlias = Callable[[Increments], FloatArray]  # what the attacker is paid in that step, (B,)
Weights: TypeAlias = tuple[tuple[str, float], ...]  # of metrics by name, as a configuration keeps them
Payoff: TypeAlias = str | Weights | PayFunction
FIELD = "payoff"  # the name of the field in every configuration that has one
MOST = 1e9  # the largest weight


def objective(words: Mapping[str, Mapping[str, float]], *, source: str) -> Any:
    """A field that names the attacker's objective; the first of `words` is the default, which the game itself counts.

    The other words stand for weights of metrics. The field also takes such weights, written as a mapping from metrics
    to numbers; or a function that gets the increments of all metrics in a game step, each (B,), and returns the
    attacker's reward for them, (B,). A text `module:attribute` names such a function.
    """
    metadata = {"unit": "-", "low": -MOST, "high": MOST, "source": source, "choices": tuple(words), "ranged": False}
    metadata |= {"bodies": "", "series": "", "form": (), "words": dict(words)}
    return dataclasses.field(default=next(iter(words)), metadata=metadata)


def is_objective(field: dataclasses.Field[Any]) -> bool:
    """Whether a field was made by `objective`."""
    return "words" in field.metadata


def check_objective(field: dataclasses.Field[Any], value: Any) -> None:
    """That a value is a word of the field, weights, a function, or the text that names one.

    Raises:
        ConfigurationError: it is none of them.
    """
    words = field.metadata["choices"]
    if callable(value) or (isinstance(value, str) and (value in words or ":" in value)):
        return
    given = f"{field.name} = {shown(value)}"
    if isinstance(value, str):
        raise ConfigurationError(
            f"{given} is not one of {', '.join(words)}. {near(value, words)} Weights of metrics are written "
            "{'METRIC': 1.0}"
        )
    if not isinstance(value, tuple) or not all(isinstance(part, tuple) and len(part) == 2 for part in value):
        raise ConfigurationError(
            f"{given} must be one of {', '.join(words)}; weights of metrics, such as {{'METRIC': 1.0}}; or a function"
        )
    for name, weight in value:
        right = isinstance(weight, (int, float)) and not isinstance(weight, bool) and math.isfinite(weight)
        if not right or abs(weight) > MOST:
            raise ConfigurationError(
                f"{field.name}: the weight of {name} is {shown(weight)}, but must be a number within +-{MOST:g}"
            )
    if not any(weight for _, weight in value):
        raise ConfigurationError(
            f"{field.name} = {shown(dict(value))} pays nothing: give a metric a weight other than 0"
        )


def is_own(config: Any) -> bool:
    """Whether a configuration pays what its game itself counts, of which all published numbers are."""
    field = next((each for each in dataclasses.fields(config) if is_objective(each)), None)
    return field is None or bool(getattr(config, field.name) == field.default)


def weights_of(config: Any) -> Weights | str | PayFunction | None:
    """The weights that a configuration pays, its function or the text that names one; None: the game's own payoff."""
    if is_own(config):
        return None
    field = next(each for each in dataclasses.fields(config) if is_objective(each))
    value = getattr(config, field.name)
    words = field.metadata["words"]
    return tuple(words[value].items()) if isinstance(value, str) and value in words else value


def foreign_pay(problem: str, config: Any) -> str:
    """A sentence about what no longer holds where a configuration pays something else; empty where it does not."""
    if is_own(config):
        return ""
    return (
        f"{FIELD} is not the one that {problem} itself counts: certified bounds, frozen scores, and the numbers and "
        "networks of shipped policies are for that one"
    )
