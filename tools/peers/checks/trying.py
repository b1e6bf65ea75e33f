"""What the checks of all peers share: a check is a function; its outcome is a line of JSON."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable, Iterable
from typing import Any

import gymnasium

import cps_envs  # noqa: F401  registers the environments

IDS = sorted(str(env_id) for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
PLAIN = [env_id for env_id in IDS if "Discrete-" not in env_id]
DUELS = ("disbanding", "fdi", "hvac", "rogue")
WORKS, ADAPTED, FAILS = "works", "works with an adapter", "does not work"


def attempt(what: str, check: Callable[[], Any], adapter: str = "") -> None:
    """Report how a check went; `adapter` says what had to stand between."""
    try:
        check()
    except Exception as error:
        traceback.print_exc()
        note = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        print(json.dumps({"what": what, "outcome": FAILS, "note": note.replace("|", "/")}), flush=True)
    else:
        outcome = ADAPTED if adapter else WORKS
        print(json.dumps({"what": what, "outcome": outcome, "note": adapter}), flush=True)


def each(check: Callable[[str], Any], names: Iterable[str]) -> Callable[[], None]:
    """A check of several names, which says for which one it failed."""

    def run() -> None:
        for name in names:
            try:
                check(name)
            except Exception as error:
                raise RuntimeError(f"{name}: {type(error).__name__}: {error}") from error

    return run
