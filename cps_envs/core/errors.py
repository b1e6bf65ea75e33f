"""Errors that say what was wrong and what to do about it."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Iterable
from types import ModuleType

EXTRAS = {  # package -> the extra of ours that installs it
    "cps_paper": "paper",
    **dict.fromkeys(("scipy", "highspy", "cma", "matplotlib"), "baselines"),
    **dict.fromkeys(("stable_baselines3", "sb3_contrib"), "sb3"),
    "torch": "train",
    "pymoo": "genetic",
    "minari": "data",
    "pygame": "render",
    "ray": "ray",
}


class ConfigurationError(ValueError):
    """A configuration value that the problem cannot be built with."""


class UnknownOptionError(ConfigurationError, TypeError):
    """An argument that an environment does not have; also a TypeError, as of any function with keyword arguments."""


class UnknownNameError(LookupError):
    """A name that nothing is registered under."""

    def __str__(self) -> str:
        return str(self.args[0])


class UntrustedCodeError(UnknownNameError):
    """A text names code that nobody has agreed to run."""


class MissingExtraError(ImportError):
    """An optional package that the requested feature needs is not installed."""


class PolicyError(ValueError):
    """A policy's own code failed while it played."""


def shown(value: object, most: int = 200) -> str:
    """A value as Python would write it, cut off where it is long; also one that is nested too deeply to be written."""
    try:
        text = repr(value)
    except RecursionError:
        return f"a {type(value).__name__} that is nested too deeply"
    return text if len(text) <= most else f"{text[:most]}..."


def near(name: str, known: Iterable[str]) -> str:
    """A sentence that offers the known names closest to a mistyped one, or all of them."""
    choices = sorted(known)
    close = difflib.get_close_matches(name, choices, n=3, cutoff=0.5)
    if close:
        return f"Did you mean {' or '.join(repr(match) for match in close)}?"
    return f"Known: {', '.join(choices)}." if choices else "There is nothing to choose from."


def require(module: str, *, extra: str, purpose: str) -> ModuleType:
    """Import an optional module.

    Raises:
        MissingExtraError: the module is not installed; the message gives the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise MissingExtraError(
            f'{purpose} needs the package {package!r}. Install it with: pip install "cps-envs[{extra}]"'
        ) from error
