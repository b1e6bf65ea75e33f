"""Kernels that come compiled: the distribution `cps-envs-kernels`, of one version of this library, Python and numba.

They are machine code for x86-64-v3, which Intel's processors know since about 2013 and AMD's since about 2015. Code for
the processor at hand can be faster and is taken first, where it is kept; `CPS_ENVS_NATIVE=1` in the environment
asks for no other. Kernels whose sources differ from those that were compiled are not used.
"""

from __future__ import annotations

import functools
import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from llvmlite.binding import get_host_cpu_features

NATIVE = "CPS_ENVS_NATIVE"
PACKAGE = "cps_envs_kernels"
PROCESSOR = "x86-64-v3"
FEATURES = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")  # what a processor of that name has


def folder_for(module: str) -> Path | None:
    """Where compiled kernels of a module would lie; None if there are none, none that run here, or none wanted."""
    folder = None if os.environ.get(NATIVE, "0") not in ("", "0") else installed()
    return folder and folder / package_of(module)


def package_of(module: str) -> str:
    """The package of a module, after which the folder of its kernels is called."""
    return module.rpartition(".")[0]


def key_for(key: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """What numba files a kernel under, with the processor that shipped kernels are compiled for."""
    signature, (triple, _, _), code = key
    return signature, (triple, PROCESSOR, ""), code


@functools.cache
def installed() -> Path | None:
    """The folder of the distribution, if it is installed and this processor runs its kernels."""
    spec = find_spec(PACKAGE)
    places = list(spec.submodule_search_locations or ()) if spec else []
    return Path(places[0]) if places and runs_here() else None


def runs_here() -> bool:
    """Whether this processor knows what `PROCESSOR` does."""
    known = get_host_cpu_features()
    return all(known.get(name, False) for name in FEATURES)
