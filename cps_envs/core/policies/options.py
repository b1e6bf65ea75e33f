"""Whether the options of a policy are of the kind that it says it takes."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from types import NoneType
from typing import Any

from cps_envs.core.errors import ConfigurationError, near, shown

KINDS: Mapping[str, tuple[type, str]] = {  # by annotation
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "str": (str, "a word"),
    "bool": (bool, "true or false"),
    "None": (NoneType, "null"),
}


def check_policy_options(target: Callable[..., Any], options: Mapping[str, Any], name: str) -> None:
    """That options are those of `target`, which builds a policy of this name, and what its annotations say.

    These are numbers, words, true or false, or objects. Annotations of other kinds are the policy's own business.

    Raises:
        ConfigurationError: there is no such option, or it is of another kind.
    """
    parameters = inspect.signature(target).parameters if options else {}
    if not any(each.kind is each.VAR_KEYWORD for each in parameters.values()):
        own = list(parameters)[1:]  # behind the role's specification
        for unknown in (each for each in options if each not in own):
            raise ConfigurationError(f"the policy {name!r} has no option {unknown!r}. {near(unknown, own)}")
    for name in options.keys() & parameters.keys():
        kinds = [_kind(word, target) for word in _words(parameters[name].annotation)]
        known = [each for each in kinds if each is not None]
        if len(known) == len(kinds) and not any(isinstance(options[name], kind) for kind, _ in known):
            wanted = " or ".join(words for _, words in known)
            raise ConfigurationError(f"the option {name} = {shown(options[name])} must be {wanted}")


def _words(annotation: Any) -> list[str]:
    """The alternatives of an annotation."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    return [each.strip() for each in text.split("|")]


def _kind(word: str, target: Callable[..., Any]) -> tuple[type, str] | None:
    """A type and what to call it; None where any value may do."""
    module = sys.modules.get(getattr(target, "__module__", ""))
    found = getattr(module, word, None)
    if found is Any or not inspect.isclass(found) or hasattr(found, "__origin__"):
        return KINDS.get(word)
    return found, f"an object of {word}, which only code can hand over"
