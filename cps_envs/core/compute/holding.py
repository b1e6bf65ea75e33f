"""Handing many arrays to a kernel at the price of one.

Each array in a kernel's arguments costs 0.05 to 0.13 us, which for a single environment adds up to more than its step
of physics. `hold` notes once where the arrays of a named tuple lie. A kernel uses what is held like the tuple itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from numba import typeof, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, models, register_model, unbox

from cps_envs.core.compute.kernels import PLAIN

Named = TypeVar("Named", bound=tuple[Any, ...])


class Holder:
    """A named tuple of arrays, or of such tuples, ready for kernels; it keeps the arrays alive."""

    __slots__ = ("_numba_type_", "_words", "address", "named")

    def __init__(self, named: Any) -> None:
        self.named = named
        self._words = np.array(list(_words(named)), np.int64)
        self.address = self._words.ctypes.data
        self._numba_type_ = HolderType(typeof(named))  # type: ignore[no-untyped-call]

    def __getattr__(self, name: str) -> Any:
        return getattr(object.__getattribute__(self, "named"), name)

    def __reduce__(self) -> tuple[Any, ...]:
        return Holder, (self.named,)  # a copy's arrays lie elsewhere


def hold(named: Named) -> Named:
    """A named tuple of arrays, or of such tuples, for handing to kernels, which cannot tell it from the tuple.

    Its arrays are those of now: fill them, do not replace them. In a kernel they have no owners, see `kernels.lend`.
    """
    if PLAIN:
        return named
    holder: Any = Holder(named)
    held: Named = holder
    return held


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

    @property
    def key(self) -> Any:
        """What tells two types apart: the named tuple's class, as two classes may have one name."""
        return self.named


@register_model(HolderType)
class _HolderModel(models.OpaqueModel):
    pass


@unbox(HolderType)  # type: ignore[no-untyped-call,untyped-decorator]
def _unbox(_: Any, holder: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(holder, "address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(address)  # type: ignore[no-untyped-call]


@infer_getattr
class _HolderFields(AttributeTemplate):
    key = HolderType

    def generic_resolve(self, holder: Any, name: str) -> Any:  # type: ignore[override]
        """The type of an array, or of a tuple of arrays, by its name."""
        named = holder.named
        return named.types[named.fields.index(name)] if name in named.fields else None


@lower_getattr_generic(HolderType)  # type: ignore[no-untyped-call,untyped-decorator]
def _read_field(context: Any, builder: Any, holder: Any, address: Any, name: str) -> Any:
    pointer = context.get_value_type(holder.named).as_pointer()
    named = builder.load(builder.bitcast(address, pointer))
    return builder.extract_value(named, holder.named.fields.index(name))
