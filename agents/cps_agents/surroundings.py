"""What a command needs of the shell that starts it: memory, and environment variables that say something."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterator, Mapping

LEAST_MEMORY = 600_000_000  # bytes of addresses in which everything loads and plays, measured: 500 MB is too little
OURS = ("CPS_ENVS_TRUST", "CPS_ENVS_QUIET", "CPS_ENVS_MEETINGS", "CPS_ENVS_BROWSER")  # the last in tests only
SWITCHES = ("CPS_ENVS_TRUST", "CPS_ENVS_QUIET")
WHOLE = {"NUMBA_NUM_THREADS": 1, "NUMBA_DISABLE_JIT": 0, "SOURCE_DATE_EPOCH": 0}  # at least; numba reads them all


def short_of_memory() -> str:
    """A sentence where the process may not have the memory that a command needs; empty where it may."""
    if sys.platform == "win32":
        return ""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= LEAST_MEMORY:
        return ""
    return (
        f"this shell allows {limit / 1e6:.0f} MB of memory, and a command needs {LEAST_MEMORY / 1e6:.0f} MB at least: "
        "raise the limit, for example by `ulimit -v unlimited`"
    )


def wrong_variables(environment: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each environment variable that cannot be meant as it is."""
    for name, value in sorted(environment.items()):
        if name in WHOLE:
            if value and not (value.strip().isdecimal() and int(value) >= WHOLE[name]):
                yield f"the environment variable {name} = {value!r} must be a whole number, at least {WHOLE[name]}"
        elif name in SWITCHES:
            if value not in ("", "0", "1"):
                yield f"the environment variable {name} = {value!r} must be 1 or 0"
        elif name.startswith("CPS_ENVS_") and name not in OURS:
            close = difflib.get_close_matches(name, OURS[:-1], n=1, cutoff=0.0)
            yield f"there is no environment variable {name}: did you mean {close[0]}? Unset it otherwise"
