"""Functions that live inside kernels: they are linked into their callers, and optimised there, once and in place.

Numba by itself optimises every function that it compiles and turns it into machine code, as if Python called it. For
what only kernels call both is thrown away; and loops that were vectorised for arrays of any length before they met a
caller that knows the length stay so.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class Linked(JITCodeLibrary):
    """Code that becomes a part of kernels. It has no address of its own, so nothing of it can be called or kept."""

    def _optimize_final_module(self) -> None:
        """Nothing: whoever links it optimises."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Zero, which is numba's word for a function that is not there."""
        return 0

    @property
    def codegen(self) -> Any:
        """Numba's code generator, which has no place in memory for the environment of such a function."""
        return _WithoutEnvironment(self._codegen)


class _WithoutEnvironment:
    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def set_env(self, name: str, env: Any) -> None:
        """Nothing: only what raises, prints or needs Python objects reads it, see `kernels`."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)


class Linking(Compiler):
    """Numba's compiler for functions that are only linked; for the `pipeline_class` of `numba.njit`."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compile a function into a library of its own kind."""
        library: Any = Linked(self.state.targetctx.codegen(), func.__qualname__)  # type: ignore[no-untyped-call]
        library.enable_object_caching()
        self.state.library = library
        return super().compile_extra(func)  # type: ignore[no-untyped-call]
