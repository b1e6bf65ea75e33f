"""Handing many arrays to a kernel at the price of one.

Each array in a kernel's arguments costs 0.05 to 0.13 us, which for a single environment adds up to more than its step
of physics. `hold` notes once where the arrays of a named tuple lie. A kernel uses what is held like the tuple itself.

It also tells the compiler how long rows are, where asked to: loops over four vehicles or three sensors become straight
code. Each set of sizes then compiles a kernel of its own, so a game asks for it in the sizes of its presets only; all
others share one kernel.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numba import typeof, types
from numba.core.cgutils import pack_array, unpack_tuple
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, models, register_model, unbox
from numba.np.arrayobj import make_array, update_array_info

from cps_envs.core.compute.kernels import PLAIN
from cps_envs.core.types import Array

Shapes: TypeAlias = tuple[Any, ...]  # of a named tuple's fields, see `HolderType`
Named = TypeVar("Named", bound=tuple[Any, ...])


class Holder:
    """A named tuple of arrays, or of such tuples, ready for kernels; it keeps the arrays alive."""

    __slots__ = ("_numba_type_", "_words", "address", "named")

    def __init__(self, named: Any, told: bool) -> None:
        self.named = named
        self._words = np.array(list(_words(named)), np.int64)
        self.address = self._words.ctypes.data
        shapes = shapes_of(named) if told else unknown(named)
        self._numba_type_ = HolderType(typeof(named), shapes)  # type: ignore[no-untyped-call]

    def __getattr__(self, name: str) -> Any:
        return getattr(object.__getattribute__(self, "named"), name)

    def __reduce__(self) -> tuple[Any, ...]:
        kind = self._numba_type_
        return Holder, (self.named, kind.shapes != unknown(self.named))  # a copy's arrays lie elsewhere


def hold(named: Named, told: bool = False) -> Named:
    """A named tuple of arrays, or of such tuples, for handing to kernels, which cannot tell it from the tuple.

    `told`: whether the compiler knows how long rows are, see above. Its arrays are those of now: fill them, do not
    replace them. In a kernel they have no owners, see `kernels.lend`.
    """
    if PLAIN:
        return named
    holder: Any = Holder(named, told)
    held: Named = holder
    return held


def shapes_of(named: Any) -> Shapes:
    """What the compiler is told of the arrays of a named tuple, see `HolderType.shapes`: how long their rows are.

    The first axis counts environments, and the first of several others steps or blocks: these may have any length, so
    that a longer episode needs no other kernel. Yet that one is empty is told, as whole branches go by it.
    """
    return tuple(shapes_of(each) if isinstance(each, tuple) else _shape_of(each) for each in named)


def unknown(named: Any) -> Shapes:
    """What says nothing of the arrays of a named tuple: any length will do on each axis."""
    return tuple(unknown(each) if isinstance(each, tuple) else (None,) * each.ndim for each in named)


def _shape_of(array: Array) -> Shapes:
    inner = array.shape[1:]
    free = len(inner) - 1  # the axes before the last one
    told = (None if i < free and size > 0 else size for i, size in enumerate(inner))
    return (None, *told) if array.ndim > 0 else ()


def _words(named: Any) -> Iterator[int]:
    """The arrays as numba lays them out in memory: owner, parent, size, bytes per item, address, shape, strides."""
    for array in named:
        if isinstance(array, tuple):
            yield from _words(array)
        else:
            yield from (0, 0, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides)


class HolderType(types.Type):
    """Numba's type of a holder.

    Attributes:
        named: numba's type of the named tuple.
        shapes: of each field a tuple, in order: of an array with an entry for each axis, its length, or None where any
            length will do; of a named tuple with such a tuple for each of its fields.
    """

    def __init__(self, named: Any, shapes: Shapes) -> None:
        self.named, self.shapes = named, shapes
        super().__init__(f"Holder({named}, {shapes})")

    @property
    def key(self) -> Any:
        """What tells two types apart: the named tuple's class, as two classes may have one name, and the shapes."""
        return self.named, self.shapes


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
    named, at = builder.load(builder.bitcast(address, pointer)), holder.named.fields.index(name)
    return _told(context, builder, holder.named.types[at], builder.extract_value(named, at), holder.shapes[at])


def _told(context: Any, builder: Any, kind: Any, value: Any, shapes: Shapes) -> Any:
    """An array, or a named tuple of arrays, whose lengths the compiler knows as far as `shapes` says them."""
    if not isinstance(kind, types.Array):
        for at, (part, own) in enumerate(zip(kind.types, shapes, strict=True)):
            told = _told(context, builder, part, builder.extract_value(value, at), own)
            value = builder.insert_value(value, told, at)
        return value
    array = make_array(kind)(context, builder, value)  # type: ignore[no-untyped-call]
    lengths = enumerate(unpack_tuple(builder, array.shape))  # type: ignore[no-untyped-call]
    known = [length if shapes[i] is None else context.get_constant(types.intp, shapes[i]) for i, length in lengths]
    if known:
        array.shape = pack_array(builder, known)  # type: ignore[no-untyped-call]
        update_array_info(kind, array)  # type: ignore[no-untyped-call]
    return array._getvalue()
