"""The one convention of the kernels: how they are compiled, and how they see one environment of a batch.

A problem's state is a named tuple of arrays with a leading axis of B environments; `view` cuts one environment out.
Numbers that a kernel knows by name (constants, rules, metrics) are a named tuple of int, float and bool; `records` is
an array of such tuples, which costs a kernel no more than any other array, and `unpack` reads one.

Kernels allocate nothing per step, raise nothing and call only `inlined` functions. What they work in is `room`,
and functions of numbers are those of `math`, so that a thread of a GPU runs them too, on a batch of one: see `device`.
They are compiled without checks for zero division, whose branches keep the compiler from vectorising loops, and without
fast-math, so that results do not depend on the machine.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar, get_type_hints

import numpy as np
from numba import config, njit, types
from numba.core.cgutils import get_null_value, unpack_tuple
from numba.extending import lower_builtin, overload, type_callable
from numba.np.arrayobj import _empty_nd_impl, make_array

from cps_envs.core.compute.kernel_cache import cache_by_sources
from cps_envs.core.compute.linking import Linking
from cps_envs.core.types import Array

Function = TypeVar("Function", bound=Callable[..., Any])
Numbers = TypeVar("Numbers", bound=Array)
Named = TypeVar("Named", bound=tuple[Any, ...])
Record: TypeAlias = Any  # one element of a structured array, with its fields as attributes

PLAIN = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]  # NUMBA_DISABLE_JIT=1: kernels are plain Python
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
INSIDE: Any = OPTIONS | {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "forceinline": True,
    "pipeline_class": Linking,
}
NAMED: Any = types.BaseNamedTuple
NAMED_CLASS: Any = types.NamedTupleClass
SCALARS = {int: np.int64, float: np.float64, bool: np.bool_}


def kernel(function: Function) -> Function:
    """Compile a function that Python calls, and keep the result for later processes.

    With NUMBA_DISABLE_JIT=1 in the environment it stays plain Python.
    """
    if PLAIN:
        return function
    dispatcher: Function = njit(**OPTIONS)(function)
    return cache_by_sources(dispatcher)


def inlined(function: Function) -> Function:
    """Have kernels that call a function contain it, see `linking`. Called from Python it runs as plain Python.

    It raises nothing: neither by itself nor by what it calls.
    """
    if PLAIN:
        return function
    dispatcher: Any = njit(**INSIDE)(function)
    dispatcher._insert = lambda *_: None  # there is no wrapper that Python could call
    dispatcher._compile_for_args = lambda *_, **__: function
    inside: Function = dispatcher
    return inside


def maker(function: Function) -> Function:
    """An `inlined` function that returns arrays of its own `room`: compiled as if it stood where it is called.

    On a GPU such an array lives as long as the function that makes it.
    """
    if PLAIN:
        return function
    dispatcher: Any = njit(inline="always", **INSIDE)(function)
    dispatcher._compile_for_args = lambda *_, **__: function
    inside: Function = dispatcher
    return inside


def borrowed(array: Numbers) -> Numbers:
    """The array without its owner, so that handing it and its views on costs no counting of references.

    Counting takes longer than a short step of physics. For arguments only: whoever calls the kernel keeps those alive.
    """
    return array


@type_callable(borrowed)
def _type_borrowed(_: Any) -> Any:
    return lambda array: array if isinstance(array, types.Array) else None


@lower_builtin(borrowed, types.Array)  # type: ignore[no-untyped-call,untyped-decorator]
def _borrow(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    view = make_array(signature.return_type)(context, builder, arguments[0])  # type: ignore[no-untyped-call]
    for owner in ("meminfo", "parent"):
        nobody = get_null_value(getattr(view, owner).type)  # type: ignore[no-untyped-call]
        setattr(view, owner, nobody)
    return view._getvalue()


def room(shape: Any, dtype: Any = np.float64) -> Array:
    """An array to work with, of unknown content; on a GPU one of the thread's own, see `core.device`.

    Kernels and their `maker` functions ask for all of it before they begin with an environment.
    """
    made: Array = np.empty(shape, dtype)
    if _rooms is not None:
        _rooms.append(made)
    return made


_rooms: list[Array] | None = None  # what plain Python has made, while somebody wants to know


@type_callable(room)
def _type_room(_: Any) -> Any:
    def typer(shape: Any, dtype: Any = None) -> Any:
        axes = len(shape) if isinstance(shape, types.BaseTuple) else 1
        return types.Array(types.float64 if dtype is None else dtype.dtype, axes, "C")

    return typer


@lower_builtin(room, types.Any)  # type: ignore[no-untyped-call,untyped-decorator]
@lower_builtin(room, types.Any, types.Any)  # type: ignore[no-untyped-call,untyped-decorator]
def _make_room(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    shape, made = signature.args[0], signature.return_type
    tupled = isinstance(shape, types.BaseTuple)
    sizes = unpack_tuple(builder, arguments[0]) if tupled else [arguments[0]]  # type: ignore[no-untyped-call]
    return _empty_nd_impl(context, builder, made, sizes)._getvalue()  # type: ignore[no-untyped-call]


def view(state: Named, b: int) -> Named:
    """Environment `b` of a named tuple of arrays (B, ...): the same names without the axis B.

    What is (B,) becomes an array of length one, so that it can be written: `episode.step[0] += 1`.
    """
    return type(state)(*(array[b : b + 1] if array.ndim == 1 else array[b] for array in state))


def lend(arrays: Named) -> Named:
    """A named tuple of arrays without their owners, see `borrowed`: what all environments share, such as matrices."""
    return arrays


@functools.cache  # one object per class
def record_type(numbers: Any) -> np.dtype[np.void]:
    """The structured type whose fields are those of a named tuple of int, float and bool.

    One object for each class: numba recognises types that it has seen before by their identity, a microsecond sooner.
    """
    hints = get_type_hints(numbers)
    return np.dtype([(name, SCALARS[hints[name]]) for name in numbers._fields], align=True)


def records(numbers: Any, size: int) -> Array:
    """An array (size,) of zeros with the fields of a named tuple of int, float and bool."""
    return with_attributes(np.zeros(size, record_type(numbers)))


def pack(numbers: Any) -> Array:
    """A named tuple of numbers as records (1,): what all environments share, such as the rules of a configuration."""
    kind: Any = type(numbers)
    return with_attributes(np.array([tuple(numbers)], record_type(kind)))


def with_attributes(table: Array) -> Array:
    """Records as they are, or under NUMBA_DISABLE_JIT=1 in the form whose fields plain Python finds by name."""
    return table.view(np.recarray) if PLAIN else table


def unpack(numbers: type[Named], table: Array, b: int) -> Named:
    """Row `b` of records as a named tuple: values, which the compiler may keep in registers, unlike a record's fields.

    Rows that are written, such as metrics, are used as they are: `table[b].damage = ...`.
    """
    return numbers(*(table[b][name].item() for name in numbers._fields))  # type: ignore[attr-defined]


def _generated(arguments: tuple[str, ...], call: str, make: Any) -> Callable[..., Any]:
    """A function that makes a named tuple; `call` is the source of the making."""
    scope = {"make": make, "borrowed": borrowed}
    annotated = ", ".join(f"{name}: Any" for name in arguments)  # numba compares this with the overload's own
    exec(f"def generated({annotated}):\n    return make({call})", scope)
    made: Callable[..., Any] = scope["generated"]
    return made


def _named(arrays: Any) -> Any:
    """Numba's type of a named tuple of arrays, also of one that `holding.hold` keeps; None of anything else."""
    named = getattr(arrays, "named", arrays)
    return named if isinstance(named, NAMED) else None


@overload(view, jit_options=INSIDE)
def _view(state: Any, b: Any) -> Any:
    if (named := _named(state)) is None:
        return None
    cuts = ["b : b + 1" if array.ndim == 1 else "b" for array in named.types]
    parts = [f"borrowed(state.{name})[{cut}]" for name, cut in zip(named.fields, cuts, strict=True)]
    return _generated(("state", "b"), ", ".join(parts), named.instance_class)


@overload(lend, jit_options=INSIDE)
def _lend(arrays: Any) -> Any:
    if (named := _named(arrays)) is None:
        return None
    return _generated(("arrays",), ", ".join(f"borrowed(arrays.{name})" for name in named.fields), named.instance_class)


@overload(unpack, jit_options=INSIDE)
def _unpack(numbers: Any, table: Any, b: Any) -> Any:
    if not isinstance(numbers, NAMED_CLASS):
        return None
    parts = [f"borrowed(table)[b].{name}" for name in numbers.instance_class._fields]
    return _generated(("numbers", "table", "b"), ", ".join(parts), numbers.instance_class)


@inlined
def fill(target: Array, value: float) -> None:
    """Set every entry of an array (k,)."""
    for i in range(target.size):
        target[i] = value


@inlined
def copy(values: Array, target: Array) -> None:
    """Write an array (k,) into another; unlike `target[:] = values` without tests of shapes and overlap."""
    for i in range(values.size):
        target[i] = values[i]


@inlined
def clip(value: float, low: float, high: float) -> float:
    """The value limited to [low, high]."""
    return min(max(value, low), high)


@inlined
def least(values: Array) -> float:
    """The smallest of numbers (k,), k > 0."""
    found: float = values[0]
    for i in range(1, values.size):
        found = min(found, values[i])
    return found


@inlined
def nearest(value: float) -> int:
    """The nearest whole number, of two the even one, like `np.rint`."""
    below = math.floor(value)
    beyond = value - below
    up = beyond > 0.5 or (beyond == 0.5 and below % 2 == 1)
    return below + 1 if up else below
