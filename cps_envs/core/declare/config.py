"""Configurations as frozen dataclasses whose fields carry unit, bounds and source, and reject what cannot be right."""

from __future__ import annotations

import dataclasses
import math
import os
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from cps_envs.core.declare.bodies import names_each
from cps_envs.core.declare.objective import FIELD, check_objective, is_objective
from cps_envs.core.declare.objective import objective as objective
from cps_envs.core.declare.series import Series, series_of
from cps_envs.core.errors import ConfigurationError, UnknownOptionError, near, shown
from cps_envs.core.types import ROLES, FloatArray, Role

Range = float | tuple[float, float]  # an exact value, or the bounds of a uniform draw at each reset
IntRange = int | tuple[int, int]
Bodies = float | tuple[float, ...]  # of all bodies, or one value for each
RangedBodies = Range | tuple[Range, ...]  # the same, each a value or the bounds of a draw; see `bodies`
OverTime = float | tuple[float, ...] | Series  # of all bodies, one value for each, or a series
TRACES = "traces"  # the argument that fills fields from a file
NUMBER = re.compile(r"[+-]?(\d[\d_]*\.?\d*|\.\d+)([eE][+-]?\d+)?")  # as people write one
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
    bodies: str = "",
    series: str = "",
    form: Sequence[Role] = (),
    instead_of: str = "",
) -> Any:
    """A dataclass field with its unit, its admissible interval [low, high], and where the number comes from.

    A `ranged` field takes either one value or a pair (low, high) from which each reset draws uniformly. A field
    annotated `tuple[int, ...]`, `tuple[float, ...]` or, with choices, `tuple[str, ...]` takes any number of entries,
    each of which obeys the bounds or is one of the choices. With `bodies`, such as "zone", a field takes one value for
    all of them, or a tuple with one for each, which the configuration counts; of a ranged one each may be a pair. With
    `series`, a rule of `series.RULES`, it takes a `Series` too, which is resampled by that rule; a default () leaves it
    out. `form` names the roles of which the field says how they see and act, and not what happens: a trained policy
    brings its own value along. `instead_of` names another field that says the same and counts before this one: an
    override of this one alone sets that to its default, and another value of this one beside that is refused.
    """
    metadata = {"unit": unit, "low": low, "high": high, "source": source, "choices": tuple(choices), "ranged": ranged}
    metadata |= {"bodies": bodies, "series": series, "form": tuple(form), "instead_of": instead_of}
    return dataclasses.field(default=default, metadata=metadata)


def form_fields(config: Any, *roles: str) -> tuple[str, ...]:
    """The fields of a configuration that say how one of these roles sees and acts; of either without roles."""
    wanted = set(roles or ROLES)
    return tuple(each.name for each in dataclasses.fields(config) if wanted & set(each.metadata.get("form", ())))


def series_fields(config: Any) -> dict[str, str]:
    """The fields of a configuration, or of its class, that take a series, and their units."""
    return {each.name: each.metadata["unit"] for each in dataclasses.fields(config) if each.metadata.get("series")}


def series_in(config: Any) -> dict[str, Series]:
    """The fields of a configuration that are a series."""
    given = {name: getattr(config, name) for name in series_fields(config)}
    return {name: value for name, value in given.items() if isinstance(value, Series)}


def extremes(value: OverTime) -> tuple[float, float]:
    """The least and the largest value, of all bodies and times."""
    if isinstance(value, Series):
        return float(value.values.min()), float(value.values.max())
    return (min(value), max(value)) if isinstance(value, tuple) else (value, value)


def over_time(config: Any, name: str, times_s: FloatArray, count: int) -> FloatArray:
    """A field at some times (T,), one column for each of `count` bodies: (T, count)."""
    value = getattr(config, name)
    rule = next(each.metadata["series"] for each in dataclasses.fields(config) if each.name == name)
    rows = value.at(times_s, rule) if isinstance(value, Series) else np.reshape(np.array(value, np.float64), (1, -1))
    found: FloatArray = np.broadcast_to(rows, (len(times_s), count)).copy()
    return found


def of_bodies(value: Bodies, count: int) -> FloatArray:
    """A value for each of `count` bodies, (count,)."""
    return np.broadcast_to(np.array(value, np.float64), (count,)).copy()


def check_bodies(config: Any, counts: Mapping[str, int]) -> None:
    """See that fields of bodies have one value for all, or one for each of so many, by kind: `{"zone": 4}`.

    Raises:
        ConfigurationError: one has another number of them.
    """
    for field in dataclasses.fields(config):
        if word := field.metadata.get("bodies"):
            value = getattr(config, field.name)
            given = value.width if isinstance(value, Series) else len(value) if isinstance(value, tuple) else 1
            ranged = field.metadata["ranged"]
            if given not in (1, counts[word]) and not (ranged and given > 1 and not names_each(value)):
                pairs = "; two numbers are a draw, so that two are written as ((a, a), (b, b))" if ranged else ""
                wrong = f"{field.name} has {given} values for {counts[word]} {word}s"
                raise ConfigurationError(f"{wrong}; give one for all, or one for each{pairs}.")


def bounds(value: Any) -> tuple[float, float]:
    """The interval that a ranged quantity is drawn from, of all bodies together; both ends equal where it is exact."""
    if not isinstance(value, tuple):
        return value, value
    ends = [bounds(part) for part in value]
    return min(low for low, _ in ends), max(high for _, high in ends)


def is_multiple(whole: float, part: float) -> bool:
    """Whether `part` divides `whole` up to rounding."""
    return whole >= part - 1e-9 and abs(whole / part - round(whole / part)) < 1e-6


def configure(base: Config, overrides: Mapping[str, Any]) -> Config:
    """`base` with some fields replaced and everything checked.

    A class whose numbers depend on one another has a method `following(given)`: the values that other fields take where
    only these are given.

    Raises:
        UnknownOptionError: an unknown field; the message names the near ones.
        ConfigurationError: a wrong type or a value out of bounds; the message names the remedy.
    """
    fields, timed = {field.name for field in dataclasses.fields(base)}, series_fields(base)  # type: ignore[arg-type]
    for name in overrides:
        if name not in fields and not (name == TRACES and timed):
            raise UnknownOptionError(
                f"{type(base).__name__} has no field {name!r} (unexpected keyword argument {name!r}). "
                f"{near(name, [*fields, TRACES] if timed else fields)}"
            )
    own = {name: _field(name, value, timed) for name, value in overrides.items() if name != TRACES}
    if overrides.get(TRACES) is not None:
        own = _with_traces(overrides[TRACES], timed, own)
    follows = getattr(base, "following", None)
    derived = follows(own) if follows is not None else {}
    return dataclasses.replace(base, **{**derived, **_replaced(base, own), **own})  # type: ignore[type-var]


def _replaced(base: Any, own: Mapping[str, Any]) -> dict[str, Any]:
    """The defaults of fields in whose place others are given."""
    declared = {field.name: field for field in dataclasses.fields(base)}
    pairs = [(name, other) for name in own if (other := declared[name].metadata.get("instead_of"))]
    for name, other in pairs:
        if own.get(other) and own[name] != getattr(base, name):
            raise ConfigurationError(f"{name} and {other} say the same: leave one of them out")
    return {other: declared[other].default for _, other in pairs if other not in own}


def is_drawn(field: dataclasses.Field[Any]) -> bool:
    """Whether episodes draw a quantity where it is given as a pair (low, high)."""
    return bool(field.metadata.get("ranged"))


def widened(config: Config, asked: Config) -> Config:
    """`config` with ranges that hold those of `asked`, too: what a game has to be made for that plays both.

    Raises:
        ConfigurationError: such a configuration cannot be.
    """
    changes: dict[str, Any] = {}
    declared: tuple[dataclasses.Field[Any], ...] = dataclasses.fields(config)  # type: ignore[arg-type]
    for field in filter(is_drawn, declared):
        own, theirs = bounds(getattr(config, field.name)), bounds(getattr(asked, field.name))
        if own[0] > theirs[0] or own[1] < theirs[1]:
            changes[field.name] = (min(own[0], theirs[0]), max(own[1], theirs[1]))
    return dataclasses.replace(config, **changes) if changes else config  # type: ignore[type-var]


def _with_traces(path: Any, timed: Mapping[str, str], own: dict[str, Any]) -> dict[str, Any]:
    """Overrides with the series of a file."""
    if not isinstance(path, (str, os.PathLike)):
        raise ConfigurationError(f"{TRACES} = {shown(path)} must be the path of a file.")
    from cps_envs.core.declare.traces import read_traces

    found = read_traces(os.fspath(path), timed)
    if both := sorted(set(found) & set(own)):
        raise ConfigurationError(f"{both[0]} is given, and {path} has a column of it: leave one of them out.")
    return {**own, **found}


def _field(name: str, value: Any, timed: Mapping[str, str]) -> Any:
    if name in timed and isinstance(value, Mapping):
        return series_of(name, value)
    if name == FIELD and isinstance(value, Mapping):
        return tuple((str(metric), _plain(value[metric])) for metric in sorted(value, key=str))
    return plain(name, value)


def plain(name: str, value: Any) -> Any:
    """A value of this name with tuples for lists of any library, and Python's numbers for its numbers.

    Lists are those of JSON, arrays of NumPy, series of pandas or polars, tensors, and OmegaConf's.

    Raises:
        ConfigurationError: it is nested too deeply.
    """
    try:
        return _plain(value)
    except RecursionError as error:
        raise ConfigurationError(f"{name} is nested too deeply: give a number, a word, or a list of them.") from error


def _plain(value: Any) -> Any:
    for name in ("tolist", "to_list"):
        if not isinstance(value, type) and callable(getattr(value, name, None)):
            return _plain(getattr(value, name)())
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)):
        return tuple(_plain(part) for part in value)
    return value


def validate(config: Any) -> None:
    """Check every quantity of a configuration against its declared type, bounds and choices.

    What is a list of any library becomes a tuple, see `plain`.

    Raises:
        ConfigurationError: naming the field, the value and what is allowed.
    """
    for field in dataclasses.fields(config):
        value = plain(field.name, given := getattr(config, field.name))
        if value is not given:
            object.__setattr__(config, field.name, value)
        if is_objective(field):
            check_objective(field, value)
        elif field.metadata["choices"]:
            _check_choice(field, value)
        elif isinstance(field.default, bool):
            _check_bool(field.name, value)
        elif isinstance(field.default, str):
            _check_text(field.name, value)
        elif field.metadata["bodies"] and field.metadata["ranged"] and names_each(value):
            for part in value or ((),):
                _check_number(field, part)
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
            raise ConfigurationError(
                f"{wrong} is not one of {', '.join(choices)}. {near(shown(word), choices)}{_misread(word)}"
            )


def _check_bool(name: str, value: Any) -> None:
    if not isinstance(value, bool):
        raise ConfigurationError(f"{name} = {shown(value)} must be True or False.{_misread(value)}")


def _check_text(name: str, value: Any) -> None:
    if not isinstance(value, str):
        raise ConfigurationError(f"{name} = {shown(value)} must be text.{_misread(value)}")


def _check_number(field: dataclasses.Field[Any], value: Any) -> None:
    rule, listed, integral = field.metadata, is_list(field), is_whole(field)
    if rule["series"]:
        if isinstance(value, Series):
            return _check_series(field, value)
        if value == () == field.default:
            return None
    pair = rule["ranged"] and isinstance(value, tuple) and len(value) == 2
    several = bool(rule["bodies"]) and not rule["ranged"] and isinstance(value, tuple) and len(value) > 0
    parts = value if pair or listed or several else (value,)
    if (listed and not isinstance(value, tuple)) or not all(_is_number(part, integral) for part in parts):
        among = parts if isinstance(parts, tuple) else (value,)
        wrong = next((part for part in among if not _is_number(part, integral)), value)
        unit = "" if rule["unit"] == "-" else f" in {rule['unit']}"
        raise ConfigurationError(
            f"{field.name} = {shown(value)} must be {_kind(field, integral)}{unit}.{_misread(wrong)}"
        )
    if not all(rule["low"] <= part <= rule["high"] for part in parts):
        allowed = f"[{rule['low']:g}, {rule['high']:g}] {rule['unit']}".removesuffix(" -")
        raise ConfigurationError(f"{field.name} = {shown(value)} is outside {allowed}; the default is {field.default}.")
    if pair and value[0] > value[1]:
        raise ConfigurationError(f"{field.name} = {shown(value)}: the lower end comes first.")


def _check_series(field: dataclasses.Field[Any], series: Series) -> None:
    rule = field.metadata
    wrong = np.argwhere((series.values < rule["low"]) | (series.values > rule["high"]))
    if len(wrong):
        row, column = wrong[0].tolist()
        name = f"{field.name}_{column + 1}" if series.width > 1 else field.name
        raise ConfigurationError(
            f"{name}, {series.place(row)}: {series.values[row, column]:g} is outside "
            f"[{rule['low']:g}, {rule['high']:g}] {rule['unit']}."
        )


def _is_number(part: Any, integral: bool) -> bool:
    number = isinstance(part, int) if integral else isinstance(part, (int, float))
    return number and not isinstance(part, bool) and part == part and abs(part) != math.inf


def _misread(value: Any) -> str:
    """A sentence on what a file format has made of a value, if that is why it does not fit."""
    if isinstance(value, str) and value.strip().lower() in ("true", "false", "yes", "no", "on", "off"):
        return f" {shown(value)} is text here: write it without quotes, as true or false."
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        dotted = float(value.strip())
        return (
            f" {shown(value)} is text here, not a number: write {dotted:g} without quotes, with a point and a sign "
            f"before an exponent, as in 5.0e+5, which YAML needs."
        )
    if isinstance(value, bool):
        return f" YAML reads yes, no, on and off as {value}: put the word into quotes."
    if isinstance(value, float) and value.is_integer():
        return f" Write {value:.0f} without a point."
    return ""


def _kind(field: dataclasses.Field[Any], integral: bool) -> str:
    whole = "whole " if integral else ""
    if is_list(field):
        return f"a tuple of {whole}numbers"
    rule, kinds = field.metadata, [f"a {whole}number"]
    kinds += [f"a pair (low, high) of {whole}numbers"] if rule["ranged"] else []
    kinds += [f"a tuple with one for each {rule['bodies']}"] if rule["bodies"] else []
    kinds += ["a series (values with step_s)"] if rule["series"] else []
    return " or ".join(kinds)


def parameter_table(config: Any) -> str:
    """The quantities of a configuration as a Markdown table: name, value, unit, bounds, source."""
    rows = ["| Name | Value | Unit | Allowed | Source |", "|---|---|---|---|---|"]
    for field in dataclasses.fields(config):
        rule = field.metadata
        allowed = ", ".join(rule["choices"]) or _interval(rule["low"], rule["high"])
        allowed += ", or weights of metrics, or a function" * is_objective(field)
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
