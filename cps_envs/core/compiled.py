"""How the kernels of the problems are compiled.

Without zero-division checks, whose branches keep the compiler from vectorising the loops that follow, and without
fast-math, so that results do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.core.cgutils import get_null_value
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from cps_envs.core.types import Array

Function = TypeVar("Function", bound=Callable[..., Any])
Numbers = TypeVar("Numbers", bound=Array)

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


def _borrow(typing: Any, array: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = make_array(array)(context, builder, arguments[0])  # type: ignore[no-untyped-call]
        for owner in ("meminfo", "parent"):
            nobody = get_null_value(getattr(view, owner).type)  # type: ignore[no-untyped-call]
            setattr(view, owner, nobody)
        return view._getvalue()

    return array(array), generate


# The array without its owner, so that handing it and its views on costs no counting of references, which takes longer
# than a short step of physics. For arguments only: whoever calls the kernel keeps those alive.
borrowed: Callable[[Numbers], Numbers] = intrinsic(_borrow)  # type: ignore[assignment]
