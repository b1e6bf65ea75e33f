"""Configurations as frozen dataclasses whose fields carry unit, bounds and source, and reject what cannot be right."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from cps_envs.core.errors import ConfigurationError, UnknownOptionError, near, shown
from cps_envs.core.types import ROLES, Role

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
    form: Sequence[Role] = (),
) -> Any:
    """A dataclass field with its unit, its admissible interval [low, high], and where the number comes from.

    A `ranged` field takes either one value or a pair (low, high) from which each reset draws uniformly. A field
    annotated `tuple[int, ...]`, `tuple[float, ...]` or, with choices, `tuple[str, ...]` takes any number of entries,
    each of which obeys the bounds or is one of the choices. `form` names the roles of which the field says how they see
    and act, and not what happens: a trained policy brings its own value along.
    """
    metadata = {"unit": unit, "low": low, "high": high, "source": source, "choices": tuple(choices), "ranged": ranged}
    return dataclasses.field(default=default, metadata={**metadata, "form": tuple(form)})


def form_fields(config: Any, *roles: str) -> tuple[str, ...]:
    """The fields of a configuration that say how one of these roles sees and acts; of either without roles."""
    wanted = set(roles or ROLES)
    return tuple(each.name for each in dataclasses.fields(config) if wanted & set(each.metadata.get("form", ())))


def bounds(value: Range) -> tuple[float, float]:
    """The interval that a ranged quantity is drawn from; both ends equal where it is exact."""
    return value if isinstance(value, tuple) else (value, value)


def is_multiple(whole: float, part: float) -> bool:
    """Whether `part` divides `whole` up to rounding."""
    return whole >= part - 1e-9 and abs(whole / part - round(whole / part)) < 1e-6


def configure(base: Config, overrides: Mapping[str, Any]) -> Config:
    """`base` with some fields replaced and everything checked.

    Raises:
        UnknownOptionError: an unknown field; the message names the near ones.
        ConfigurationError: a wrong type or a value out of bounds; the message names the remedy.
    """
    fields = {field.name for field in dataclasses.fields(base)}  # type: ignore[arg-type]
    for name in overrides:
        if name not in fields:
            raise UnknownOptionError(
                f"{type(base).__name__} has no field {name!r} (unexpected keyword argument {name!r}). "
                f"{near(name, fields)}"
            )
    return dataclasses.replace(base, **{name: _field(name, value) for name, value in overrides.items()})  # type: ignore[type-var]


def _field(name: str, value: Any) -> Any:
    try:
        return _plain(value)
    except RecursionError as error:
        raise ConfigurationError(f"{name} is nested too deeply: give a number, a word, or a list of them.") from error


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
        if field.metadata["choices"]:
            _check_choice(field, value)
        elif isinstance(field.default, bool):
            _check_bool(field.name, value)
        elif isinstance(field.default, str):
            _check_text(field.name, value)
        else:
            _check_number(field, value)


def check_count(name: str, value: Any) -> int:
    """A whole number of something, at least 1.

    Raises:
        ConfigurationError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ConfigurationError(f"{name} = {shown(value)} must be a whole number, at least 1")
    return int(value)


def is_list(field: dataclasses.Field[Any]) -> bool:
    """Whether a field takes a tuple of any length."""
    return not field.metadata["ranged"] and str(field.type).endswith(", ...]")


def is_whole(field: dataclasses.Field[Any]) -> bool:
    """Whether a field takes whole numbers only."""
    return "int" in str(field.type).lower()


def _check_choice(field: dataclasses.Field[Any], value: Any) -> None:
    choices, listed, given = field.metadata["choices"], is_list(field), f"{field.name} = {shown(value)}"
    if listed and not isinstance(value, tuple):
        raise ConfigurationError(f"{given} must be a tuple of words from {', '.join(choices)}.")
    for word in value if listed else (value,):
        if not isinstance(word, str) or word not in choices:
            wrong = f"{given}: {shown(word)}" if listed else given
            raise ConfigurationError(f"{wrong} is not one of {', '.join(choices)}. {near(shown(word), choices)}")


def _check_bool(name: str, value: Any) -> None:
    if not isinstance(value, bool):
        raise ConfigurationError(f"{name} = {shown(value)} must be True or False.")


def _check_text(name: str, value: Any) -> None:
    if not isinstance(value, str):
        raise ConfigurationError(f"{name} = {shown(value)} must be text.")


def _check_number(field: dataclasses.Field[Any], value: Any) -> None:
    rule, listed, integral = field.metadata, is_list(field), is_whole(field)
    pair = rule["ranged"] and isinstance(value, tuple) and len(value) == 2
    parts = value if pair or listed else (value,)
    if (listed and not isinstance(value, tuple)) or not all(_is_number(part, integral) for part in parts):
        raise ConfigurationError(f"{field.name} = {shown(value)} must be {_kind(field, integral)} in {rule['unit']}.")
    if not all(rule["low"] <= part <= rule["high"] for part in parts):
        allowed = f"[{rule['low']:g}, {rule['high']:g}] {rule['unit']}"
        raise ConfigurationError(f"{field.name} = {shown(value)} is outside {allowed}; the default is {field.default}.")
    if pair and value[0] > value[1]:
        raise ConfigurationError(f"{field.name} = {shown(value)}: the lower end comes first.")


def _is_number(part: Any, integral: bool) -> bool:
    number = isinstance(part, int) if integral else isinstance(part, (int, float))
    return number and not isinstance(part, bool) and part == part and abs(part) != math.inf


def _kind(field: dataclasses.Field[Any], integral: bool) -> str:
    whole = "whole " if integral else ""
    if is_list(field):
        return f"a tuple of {whole}numbers"
    return f"a {whole}number" + (f" or a pair (low, high) of {whole}numbers" if field.metadata["ranged"] else "")


def parameter_table(config: Any) -> str:
    """The quantities of a configuration as a Markdown table: name, value, unit, bounds, source."""
    rows = ["| Name | Value | Unit | Allowed | Source |", "|---|---|---|---|---|"]
    for field in dataclasses.fields(config):
        rule = field.metadata
        allowed = ", ".join(rule["choices"]) or _interval(rule["low"], rule["high"])
        shown = getattr(config, field.name)
        if is_list(field):
            allowed, shown = (
                f"{'any of' if rule['choices'] else 'each'} {allowed}",
                ", ".join(map(str, shown)) or "none",
            )
        rows.append(f"| `{field.name}` | {shown} | {rule['unit']} | {allowed} | {rule['source']} |")
    return "\n".join(rows)


def _interval(low: float, high: float) -> str:
    return "any" if low == -math.inf and high == math.inf else f"{low:g} to {high:g}"
