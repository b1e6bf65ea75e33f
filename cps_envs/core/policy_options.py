"""Whether the options of a policy are of the kind that it says it takes."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Any

from cps_envs.core.errors import ConfigurationError, shown

KINDS: Mapping[str, tuple[type, str]] = {  # by annotation; other annotations are the policy's own business
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "str": (str, "a word"),
}


def check_policy_options(target: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """That numbers and words are given where what builds a policy is annotated with them.

    Raises:
        ConfigurationError: an option is of another kind.
    """
    parameters = inspect.signature(target).parameters if options else {}
    for name, value in options.items():
        kinds = _kinds(parameters[name].annotation) if name in parameters else []
        known = [KINDS[kind] for kind in kinds if kind in KINDS]
        if not known or (value is None and "None" in kinds) or len(known) < len(kinds) - ("None" in kinds):
            continue
        if not any(isinstance(value, kind) for kind, _ in known):
            wanted = " or ".join(words for _, words in known)
            raise ConfigurationError(f"the option {name} = {shown(value)} must be {wanted}")


def _kinds(annotation: Any) -> list[str]:
    """The alternatives of an annotation, as words."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    return [each.strip() for each in text.split("|")]
