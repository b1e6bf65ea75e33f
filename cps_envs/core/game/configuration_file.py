"""A system of one's own in a TOML file: problem, preset, changed fields, what is paid. Every door takes such a file."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cps_envs.core.declare.config import TRACES, is_list, series_fields
from cps_envs.core.declare.objective import FIELD, is_objective
from cps_envs.core.declare.series import Series
from cps_envs.core.documents import Entry, read_toml
from cps_envs.core.errors import ConfigurationError, near, shown
from cps_envs.core.game.problem import Problem

ARGUMENT = "config"  # of environments, and `--config` of commands
ENTRIES = ("problem", "preset", TRACES, FIELD, "fields")
KIND, REMEDY = "configuration in TOML", "`cps-envs list PROBLEM --config` writes one that works."
MOST_BYTES = 2**20
WIDTH = 118  # of a line of a template


@dataclass(frozen=True)
class ConfigurationFile:
    """What a configuration file says."""

    path: Path
    problem: str
    preset: str | None  # None: the problem's usual one
    overrides: Mapping[str, Any]  # fields of the configuration

    def of(self, problem: Problem, preset: str | None, overrides: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
        """The preset and the changed fields, where `preset` and `overrides` are named beside the file: these win.

        Raises:
            ConfigurationError: the file is for another problem, names another preset than the one beside it, or its
                fields cannot be right.
        """
        if self.problem != problem.name:
            raise ConfigurationError(
                f"{self.path} is for the problem {self.problem!r}, not for {problem.name!r}: name that one, or another "
                "file"
            )
        if preset is not None and self.preset not in (None, preset):
            raise ConfigurationError(
                f"{self.path} starts from the preset {self.preset!r}, and {preset!r} is asked for: leave one of them "
                "out"
            )
        chosen = self.preset or preset or problem.usual_preset
        try:
            problem.config(chosen, self.overrides)
        except ConfigurationError as error:
            raise type(error)(f"{self.path}: {error}") from error
        return chosen, {**self.overrides, **overrides}


def read_configuration(path: str | os.PathLike[str]) -> ConfigurationFile:
    """What a configuration file says, its fields unchecked.

    Raises:
        DamagedFileError: it is no TOML, or has other entries than such a file.
        ConfigurationError: there is no such file, or it cannot be read.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise ConfigurationError(f"{ARGUMENT} = {shown(path)} must be the path of a TOML file")
    place = Path(path)
    if place.suffix.lower() != ".toml":
        raise ConfigurationError(f"{ARGUMENT} = {str(path)!r} must be a file that ends in .toml. {REMEDY}")
    try:
        document = read_toml(place, KIND, REMEDY, MOST_BYTES)
    except OSError as error:
        raise ConfigurationError(f"{place} cannot be read: {error.strerror or error}") from error
    entries = document.entries()
    fields = dict(document["fields"].plain()) if "fields" in entries else {}
    for name in entries:
        if name not in ENTRIES:
            raise document.source.error(f"there is no entry {name!r}. {near(name, ENTRIES)} Fields go below [fields]")
    preset = document.get("preset")
    for name in (TRACES, FIELD):
        if name in entries and name in fields:
            raise document.source.error(f"{name} is named twice: leave it out of [fields]")
        if name in entries:
            fields[name] = entries[name].value
    if TRACES in fields:
        fields[TRACES] = str(_beside(place, Entry(fields[TRACES], document.source, TRACES)))
    problem = document["problem"].text()
    return ConfigurationFile(place, problem, None if preset is None else preset.text(), fields)


def _beside(place: Path, named: Entry) -> Path:
    """A file that a configuration names, relative to its own."""
    found = (place.parent / named.text()).resolve()
    if not found.is_file():
        raise named.source.error(f"{named.place} = {named.value!r} is no file: there is no {found}")
    return found


def with_file(problem: Problem, preset: str | None, options: Mapping[str, Any]) -> tuple[str | None, dict[str, Any]]:
    """Preset and options of an environment, with what the file in the option `config` says put in place of it.

    What stands beside the file wins over what stands in it.

    Raises:
        DamagedFileError: the file is none.
        ConfigurationError: it is not there, for another problem, or its fields cannot be right.
    """
    if options.get(ARGUMENT) is None:
        return preset, {name: value for name, value in options.items() if name != ARGUMENT}
    beside = {name: value for name, value in options.items() if name != ARGUMENT}
    return read_configuration(options[ARGUMENT]).of(problem, preset, beside)


def template(problem: Problem, preset: str | None) -> str:
    """A configuration file of a preset that changes nothing yet: each field a comment with unit, bounds and source.

    Raises:
        ConfigurationError: there is no such preset.
    """
    chosen = problem.usual_preset if preset is None else preset
    config = problem.config(chosen, {})
    named = {field.name: field for field in dataclasses.fields(config)}
    lines = [
        f"# A system of one's own for the problem {problem.name}. Every command takes it with --{ARGUMENT} FILE.toml,",
        f'# and so does Python: gymnasium.make(id, {ARGUMENT}="FILE.toml"). What is named beside it wins over it.',
        "# Remove the `# ` in front of a line to change what it says.",
        "",
        f'problem = "{problem.name}"',
        f'preset = "{chosen}"  # one of {", ".join(problem.presets)}',
    ]
    if timed := series_fields(config):
        lines.append(f'# {TRACES} = "FILE.csv"  # columns time_s and any of {", ".join(timed)}; beside this file')
    if FIELD in named:
        words = named[FIELD].metadata["choices"]
        lines += [
            f'# {FIELD} = "{words[0]}"  # what the attacker wants: {", ".join(words)}; or weights of metrics:',
            f"# {FIELD} = {{ METRIC = 1.0, OTHER_METRIC = 0.1 }}",
        ]
    lines += ["", "[fields]"]
    for field in dataclasses.fields(config):
        if field.name != FIELD:
            lines += _described(field, getattr(config, field.name))
    return "\n".join(lines) + "\n"


def _described(field: dataclasses.Field[Any], value: Any) -> list[str]:
    """The lines of a field: itself, and what may be said of it, behind it or above it where that is too long."""
    rule = field.metadata
    if isinstance(value, Series):
        return [f"# # {field.name} is a series of the preset: {value!r}"]
    interval = f"{rule['low']:g} to {rule['high']:g}" if not rule["choices"] and _is_number(field) else ""
    each = "each " * (is_list(field) and bool(interval))
    drawn = "or [low, high] to draw from" * rule["ranged"]
    unit = "" if rule["unit"] == "-" else rule["unit"]
    allowed = ", ".join(filter(None, (unit, each + interval, " or ".join(rule["choices"]), drawn)))
    said = "; ".join(filter(None, (allowed, rule["source"])))
    line = f"# {field.name} = {toml_value(value)}"
    if len(line) + len(said) + 4 <= WIDTH:
        return [f"{line}  # {said}"]
    return [f"# # {said}", line]


def _is_number(field: dataclasses.Field[Any]) -> bool:
    return not isinstance(field.default, (bool, str)) and not is_objective(field)


def toml_value(value: Any) -> str:
    """A value of a configuration as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    return repr(value)
