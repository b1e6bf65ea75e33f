"""Consent to run the code that a text names.

A text such as `module:attribute` or `sb3:FILE` runs code when it is looked up. Such texts travel: in commands that
people copy, in recipes, in cards of trained policies. So they need the user's consent. An environment variable keeps
the consent, and so processes that are started later have it too. Three things need no consent, because their code runs
already: objects, entry points of installed packages, and what the declaration of a problem names.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from cps_envs.core.errors import UntrustedCodeError

VARIABLE = "CPS_ENVS_TRUST"
_vouched = ContextVar("vouched", default=False)


def trust() -> None:
    """Agree that texts such as `module:attribute` and `sb3:FILE` run code, in this process and those it starts."""
    os.environ[VARIABLE] = "1"


@contextmanager
def vouched() -> Iterator[None]:
    """While a reference is looked up that comes from code, not from a text of unknown origin."""
    token = _vouched.set(True)
    try:
        yield
    finally:
        _vouched.reset(token)


def require_trust(text: str) -> None:
    """Refuse to run the code that a text names unless the user has agreed.

    Raises:
        UntrustedCodeError: nobody has; the message names the ways to agree.
    """
    if os.environ.get(VARIABLE) != "1" and not _vouched.get():
        raise UntrustedCodeError(
            f"{text!r} runs code of whoever wrote it. If you trust it, write `cps-envs --trust ...` on the command "
            f"line, call cps_envs.trust() in Python, or set {VARIABLE}=1 in the environment."
        )
