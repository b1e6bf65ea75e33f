"""How the kernels of the problems are compiled.

Without zero-division checks, whose branches keep the compiler from vectorising the loops that follow, and without
fast-math, so that results do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])

# Called from Python.
kernel = njit(cache=True, nogil=True, error_model="numpy")

# Called from kernels only, without wrappers for Python, which for many arrays take a third of the compilation.
inner: Callable[[Function], Function] = njit(  # type: ignore[call-overload]
    cache=True, nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)

# The same for short functions: a call that hands on tuples of arrays costs more than what they do.
inlined: Callable[[Function], Function] = njit(  # type: ignore[call-overload]
    cache=True, nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True
)
