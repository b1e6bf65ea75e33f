"""How the kernels of this problem are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])

# No zero-division checks: their branches keep the compiler from vectorising the loops that follow.
kernel = njit(cache=True, nogil=True, error_model="numpy")

# Called from kernels only: without a wrapper for Python, which for so many arrays takes a third of the compilation.
inner: Callable[[Function], Function] = njit(  # type: ignore[call-overload]
    cache=True, nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)
