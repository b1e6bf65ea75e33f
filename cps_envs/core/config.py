"""Configurations as frozen dataclasses whose fields carry unit, bounds and source, and reject what cannot be right."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from cps_envs.core.errors import ConfigurationError, near

Range = float | tuple[float, float]  # an exact value, or the bounds of a uniform draw at each reset
IntRange = int | tuple[int, int]
Config = TypeVar("Config")


def quantity(
    default: Any,
    *,
    source: str,
    unit: str = "-",
    low: float = -math.inf,
    high: float = math.inf,
    choices: Sequence[str] = (),
    ranged: bool = False,
) -> Any:
    """A dataclass field with its unit, its admissible interval [low, high], and where the number comes from.

    A `ranged` field takes either one value or a pair (low, high) from which each reset draws uniformly.
    """
    metadata = {"unit": unit, "low": low, "high": high, "source": source, "choices": tuple(choices), "ranged": ranged}
    return dataclasses.field(default=default, metadata=metadata)


def bounds(value: Range) -> tuple[float, float]:
    """The interval that a ranged quantity is drawn from; both ends equal where it is exact."""
    return value if isinstance(value, tuple) else (value, value)


def configure(base: Config, overrides: Mapping[str, Any]) -> Config:
    """`base` with some fields replaced and everything checked.

    Raises:
        ConfigurationError: an unknown field, a wrong type or a value out of bounds; the message names the remedy.
    """
    fields = {field.name for field in dataclasses.fields(base)}  # type: ignore[arg-type]
    for name in overrides:
        if name not in fields:
            raise ConfigurationError(f"{type(base).__name__} has no field {name!r}. {near(name, fields)}")
    return dataclasses.replace(base, **{name: _plain(value) for name, value in overrides.items()})  # type: ignore[type-var]


def _plain(value: Any) -> Any:
    """Lists, as JSON has them, as tuples, and numpy's numbers as Python's."""
    if isinstance(value, (list, tuple)):
        return tuple(_plain(part) for part in value)
    return value.item() if isinstance(value, np.generic) else value


def validate(config: Any) -> None:
    """Check every quantity of a configuration against its declared type, bounds and choices.

    Raises:
        ConfigurationError: naming the field, the value and what is allowed.
    """
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        rule = field.metadata
        if rule["choices"]:
            _check_choice(field.name, value, rule["choices"])
        elif isinstance(field.default, bool):
            _check_bool(field.name, value)
        else:
            _check_number(field, value)


def _check_choice(name: str, value: Any, choices: Sequence[str]) -> None:
    if value not in choices:
        raise ConfigurationError(f"{name} = {value!r} is not one of {', '.join(choices)}. {near(str(value), choices)}")


def _check_bool(name: str, value: Any) -> None:
    if not isinstance(value, bool):
        raise ConfigurationError(f"{name} = {value!r} must be True or False.")


def _check_number(field: dataclasses.Field[Any], value: Any) -> None:
    rule = field.metadata
    integral = "int" in str(field.type).lower()
    kind = "a whole number" if integral else "a number"
    if rule["ranged"]:
        kind += f" or a pair (low, high) of {'whole ' if integral else ''}numbers"
    pair = rule["ranged"] and isinstance(value, tuple) and len(value) == 2
    parts = value if pair else (value,)
    for part in parts:
        number = isinstance(part, int) if integral else isinstance(part, (int, float))
        if isinstance(part, bool) or not number or part != part or abs(part) == math.inf:
            raise ConfigurationError(f"{field.name} = {value!r} must be {kind} in {rule['unit']}.")
        if not rule["low"] <= part <= rule["high"]:
            allowed = f"[{rule['low']:g}, {rule['high']:g}] {rule['unit']}"
            raise ConfigurationError(f"{field.name} = {value!r} is outside {allowed}; the default is {field.default}.")
    if parts[0] > parts[-1]:
        raise ConfigurationError(f"{field.name} = {value!r}: the lower end comes first.")


def parameter_table(config: Any) -> str:
    """The quantities of a configuration as a Markdown table: name, value, unit, bounds, source."""
    rows = ["| Name | Value | Unit | Allowed | Source |", "|---|---|---|---|---|"]
    for field in dataclasses.fields(config):
        rule = field.metadata
        allowed = ", ".join(rule["choices"]) or _interval(rule["low"], rule["high"])
        rows.append(
            f"| `{field.name}` | {getattr(config, field.name)} | {rule['unit']} | {allowed} | {rule['source']} |"
        )
    return "\n".join(rows)


def _interval(low: float, high: float) -> str:
    return "any" if low == -math.inf and high == math.inf else f"{low:g} to {high:g}"
