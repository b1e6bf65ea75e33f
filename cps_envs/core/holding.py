"""Handing many arrays to a kernel at the price of one.

Each array in a kernel's arguments costs 0.05 to 0.13 us, which for a single environment adds up to more than its step
of physics. `hold` notes once where the arrays of a named tuple lie; a kernel gets the holder and calls `held_by`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Generic, TypeVar

import numpy as np
from numba import typeof, types
from numba.extending import NativeValue, intrinsic, models, overload, register_model, unbox

from cps_envs.core.kernels import INSIDE

Named = TypeVar("Named", bound=tuple[Any, ...])


class Holder(Generic[Named]):
    """A named tuple of arrays, or of such tuples, ready for kernels; it keeps the arrays alive."""

    __slots__ = ("_numba_type_", "_words", "address", "named")

    def __init__(self, named: Named) -> None:
        self.named = named
        self._words = np.array(list(_words(named)), np.int64)
        self.address = self._words.ctypes.data
        self._numba_type_ = HolderType(typeof(named))  # type: ignore[no-untyped-call]

    def __reduce__(self) -> tuple[Any, ...]:
        return Holder, (self.named,)  # a copy's arrays lie elsewhere


hold = Holder


def held_by(holder: Holder[Named]) -> Named:
    """The named tuple of a holder; in a kernel its arrays have no owners, like those of `kernels.lend`."""
    return holder.named


def _words(named: Any) -> Iterator[int]:
    """The arrays as numba lays them out in memory: owner, parent, size, bytes per item, address, shape, strides."""
    for array in named:
        if isinstance(array, tuple):
            yield from _words(array)
        else:
            yield from (0, 0, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides)


class HolderType(types.Type):
    """Numba's type of a holder."""

    def __init__(self, named: Any) -> None:
        self.named = named
        super().__init__(f"Holder({named})")


@register_model(HolderType)
class _HolderModel(models.OpaqueModel):
    pass


@unbox(HolderType)  # type: ignore[no-untyped-call,untyped-decorator]
def _unbox(_: Any, holder: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(holder, "address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(address)  # type: ignore[no-untyped-call]


def _read(typing: Any, holder: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = context.get_value_type(holder.named).as_pointer()
        return builder.load(builder.bitcast(arguments[0], pointer))

    return holder.named(holder), generate


_read_holder: Any = intrinsic(_read)


@overload(held_by, jit_options=INSIDE)
def _held_by(holder: Any) -> Any:
    if not isinstance(holder, HolderType):
        return None

    def read(holder: Any) -> Any:
        return _read_holder(holder)

    return read
