"""Packages that no extra of this one installs."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from cps_envs.core.errors import MissingExtraError


def optional(module: str, *, install: str, purpose: str) -> ModuleType:
    """Import a module.

    Raises:
        MissingExtraError: it is not installed; the message says which packages `install` it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingExtraError(f"{purpose} needs more packages. Install them with: pip install {install}") from error
