"""The launcher: functions of one environment as a CUDA kernel, a thread for each environment of a batch.

Nothing is written for a GPU here but what a thread needs around the functions that the CPU runs: where the arrays of
its environment lie, and room of its own. A thread plays a batch of one. Kernels know inner shapes, and the numbers of
what all environments share, as constants, and multiply-adds stay apart ("-fma=0"), so that results have the CPU's bits.

Imported only by who asks for a GPU: it needs numba-cuda, `pip install "cps_envs[gpu]"`. It leans on parts of numba-cuda
that are not public; each is named in `HOOKS`, and tests cover each.
"""

from __future__ import annotations

import types as pytypes
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from cps_envs.core.compute import kernels
from cps_envs.core.compute.kernels import room
from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.types import Array

if not hasattr(np, "row_stack"):  # NumPy 2.5 has it no longer, and numba-cuda 0.30 asks for it at every assignment
    np.row_stack = np.vstack  # type: ignore[attr-defined]
try:
    from numba import cuda
except ImportError as error:
    raise MissingExtraError('device = "cuda" needs numba-cuda: pip install "cps_envs[gpu]"') from error

HOOKS = {
    "numpy.row_stack": "numba-cuda 0.30 looks it up under NumPy 2.5, which has taken it out",
    "numba.cuda.cudadrv.driver.LinkerOptions": "gets -fma=0: no public option keeps multiply-adds apart",
    "numba.cuda.np.arrayobj": "makes an array of an address: a thread's own room, and its part of a batch",
    "numba.cuda.target.CUDATypingContext": "takes what numba compiles for the CPU as functions of a GPU",
}
SIMULATED = not hasattr(cuda, "cudadrv") or cuda.cudadrv.__name__.startswith("numba.cuda.simulator")
THREADS = 64  # of a block; 32 to 256 differ by less than a tenth
LITERAL = 4096  # bytes up to which what all environments share becomes part of the kernel
ROOM: dict[int, int] = {1: 64, 2: 256, 3: 256}  # items of a thread's own arrays by number of axes; see `measured`


def check_card() -> None:
    """Raise where nothing can be launched.

    Raises:
        ConfigurationError: there is no CUDA device, or no driver for it.
    """
    if not SIMULATED and not cuda.is_available():
        raise ConfigurationError(
            'device = "cuda" needs an NVIDIA card with a driver for CUDA 12 or 13, and none was found here: leave it '
            "out to play on the CPU"
        )


def plain(function: Any, made: dict[Any, Any] | None = None) -> Any:
    """A function and all that it calls as plain Python, which is what the simulator runs; `made` are those so far."""
    own, made = getattr(function, "py_func", function), {} if made is None else made
    if own not in made:
        scope = dict(own.__globals__)
        cells = tuple(pytypes.CellType() for _ in own.__closure__ or ())
        made[own] = pytypes.FunctionType(own.__code__, scope, own.__name__, own.__defaults__, cells)
        for name in own.__code__.co_names:  # names of fields too, which may be those of functions
            if hasattr(each := scope.get(name), "py_func"):
                scope[name] = plain(each, made)
        for cell, known in zip(cells, own.__closure__ or (), strict=True):
            each = known.cell_contents
            called = hasattr(each, "py_func") or isinstance(each, pytypes.FunctionType)
            cell.cell_contents = plain(each, made) if called else each
    return made[own]


def leaves(world: Any, path: str = "world") -> Iterator[tuple[str, Array]]:
    """The arrays of a named tuple, or of tuples in it, with how source names them."""
    world = getattr(world, "named", world)
    if isinstance(world, tuple):
        for name, each in zip(world._fields, world, strict=True):  # type: ignore[attr-defined]
            yield from leaves(each, f"{path}.{name}")
    else:
        yield path, world


def _source(world: Any, number: Iterator[int], scope: dict[str, Any]) -> str:
    """The expression that makes the same tuples of `part0`, `part1` and so on, in the order of `leaves`."""
    world = getattr(world, "named", world)
    if not isinstance(world, tuple):
        return f"part{next(number)}(given, b)"
    kind = type(world)
    name = f"{kind.__name__}{len(scope)}"
    scope[name] = kind
    return f"{name}({', '.join(_source(each, number, scope) for each in world)})"


def cutter(world: Any, parts: list[Any]) -> Callable[[Any, int], Any]:
    """A function (given, b) that makes environment b of a world, of whose arrays `parts` make one each."""
    scope: dict[str, Any] = {f"part{i}": part for i, part in enumerate(parts)}
    text = _source(world, iter(range(len(parts))), scope)
    exec(f"def cut(given, b):\n    return {text}", scope)
    made: Callable[[Any, int], Any] = scope["cut"]
    return made


def cut_plain(world: Any, batched: list[bool]) -> Callable[[Any, int], Any]:
    """`cutter` of plain Python; `given` is a tuple of the arrays."""

    def part(i: int, own: bool) -> Callable[[Any, int], Any]:
        return (lambda given, b: given[i][b : b + 1]) if own else (lambda given, b: given[i])

    return cutter(world, [part(i, own) for i, own in enumerate(batched)])


def named_fields(array: Array) -> Array:
    """Records with fields as attributes, as plain Python needs them."""
    return array.view(np.recarray) if array.dtype.names else array


def measured(function: Callable[[Any], None], world: Any, batched: list[bool]) -> dict[int, int]:
    """The largest arrays that a function asks `room` for, in items, by number of axes: it plays one environment once.

    That is done in plain Python with a copy of environment 0.
    """
    arrays = tuple(named_fields(array[:1] if own else array).copy() for (_, array), own in zip(leaves(world), batched))  # noqa: B905
    found: dict[int, int] = {1: 1, 2: 1, 3: 1}
    kernels._rooms = []
    try:
        plain(function)(cut_plain(world, batched)(arrays, 0))
        for made in kernels._rooms:
            found[made.ndim] = max(found[made.ndim], made.size)
    finally:
        kernels._rooms = None
    return found


if not SIMULATED:
    from llvmlite import ir
    from numba.cuda import cgutils, types
    from numba.cuda.cudadrv import driver
    from numba.cuda.extending import intrinsic, lower_builtin
    from numba.cuda.np import arrayobj
    from numba.cuda.np.numpy_support import from_dtype

    WORD = ir.IntType(64)

    class Unfused(driver.LinkerOptions):
        """The linker's options, with multiply-adds kept apart; cuda-core spells its own switch in a way it refuses."""

        def _prepare_nvjitlink_options(self, as_bytes: bool = False) -> Any:
            known = super()._prepare_nvjitlink_options(as_bytes=as_bytes)
            return [*known, b"-fma=0" if as_bytes else "-fma=0"]

    driver.LinkerOptions = Unfused

    def _lay(context: Any, builder: Any, made: Any, pointer: Any, sizes: list[Any]) -> Any:
        """A contiguous array at a pointer."""
        array = arrayobj.make_array(made)(context, builder)
        item = ir.Constant(WORD, context.get_abi_sizeof(context.get_data_type(made.dtype)))
        steps, step = [], item
        for size in reversed(sizes):
            steps.append(step)
            both = isinstance(step, ir.Constant) and isinstance(size, ir.Constant)
            step = ir.Constant(WORD, step.constant * size.constant) if both else builder.mul(step, size)
        arrayobj.populate_array(
            array,
            data=builder.bitcast(pointer, array.data.type),
            shape=cgutils.pack_array(builder, sizes),
            strides=cgutils.pack_array(builder, steps[::-1]),
            itemsize=item,
            meminfo=None,
        )
        return array._getvalue()

    @lower_builtin(room, types.Integer)
    @lower_builtin(room, types.Integer, types.DType)
    @lower_builtin(room, types.Integer, types.NumberClass)
    @lower_builtin(room, types.BaseTuple)
    @lower_builtin(room, types.BaseTuple, types.DType)
    @lower_builtin(room, types.BaseTuple, types.NumberClass)
    def _own_room(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        shape, made = signature.args[0], signature.return_type
        sizes = cgutils.unpack_tuple(builder, arguments[0]) if isinstance(shape, types.BaseTuple) else [arguments[0]]
        item = context.get_data_type(made.dtype)
        place = cgutils.alloca_once(builder, ir.ArrayType(item, ROOM[made.ndim]))
        return _lay(context, builder, made, place, list(sizes))

    def _part(i: int, array: Array, own: bool, literal: bool) -> Any:
        """What makes array i of an environment from the addresses of all arrays, or as a constant of the kernel."""
        made = types.Array(from_dtype(array.dtype), array.ndim, "C")
        shape = (1, *array.shape[1:]) if own else array.shape
        content = np.ascontiguousarray(array).tobytes() if literal else b""

        @intrinsic
        def part(typing: Any, given: Any, b: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                sizes = [ir.Constant(WORD, size) for size in shape]
                if literal:
                    kept = ir.Constant(ir.ArrayType(ir.IntType(8), len(content)), bytearray(content))
                    name = f"{context.mangler('shared', [])}.{i}"
                    place = cgutils.add_global_variable(builder.module, kept.type, name, 4)
                    place.initializer, place.global_constant, place.linkage, place.align = kept, True, "internal", 16
                    pointer = builder.addrspacecast(place, ir.PointerType(kept.type), "generic")
                else:
                    table = arrayobj.make_array(given)(context, builder, arguments[0])
                    address = builder.load(builder.gep(table.data, [ir.Constant(WORD, i)]))
                    if own:
                        row = ir.Constant(WORD, array.dtype.itemsize * int(np.prod(shape, dtype=np.int64)))
                        address = builder.add(address, builder.mul(arguments[1], row))
                    pointer = builder.inttoptr(address, ir.IntType(8).as_pointer())
                return _lay(context, builder, made, pointer, sizes)

            return made(given, b), generate

        return part

    def on_device(function: Any) -> Any:
        """A function of a GPU, and so the functions in its closure."""
        inner = [cell.cell_contents for cell in function.__closure__ or ()]
        cells = [pytypes.CellType(on_device(x) if isinstance(x, pytypes.FunctionType) else x) for x in inner]
        code, scope, name, defaults = function.__code__, function.__globals__, function.__name__, function.__defaults__
        return cuda.jit(device=True)(pytypes.FunctionType(code, scope, name, defaults, tuple(cells)))

    def compiled(function: Callable[[Any], None], world: Any, batched: list[bool]) -> Any:
        """The kernel (addresses of the arrays, how many environments there are)."""
        ROOM.update(measured(function, world, batched))
        parts = []
        for i, ((_, array), own) in enumerate(zip(leaves(world), batched)):  # noqa: B905
            parts.append(_part(i, array, own, not own and 0 < array.nbytes <= LITERAL))
        cut = cuda.jit(device=True, inline="always")(cutter(world, parts))
        play = on_device(function)

        @cuda.jit
        def thread(given: Any, count: int) -> None:
            b = cuda.grid(1)
            if b < count:
                play(cut(given, b))

        return thread


class Table:
    """The arrays of a world on a card, as torch tensors, and what plays a decision of every environment with them."""

    def __init__(self, decide: Callable[[Any], None], world: Any, batched: list[bool], count: int) -> None:
        """`count` environments; `batched` tells which of the world's arrays have an axis of them.

        Raises:
            ConfigurationError: there is no card.
        """
        import torch

        check_card()
        self._torch, self._count, self._graph = torch, count, None
        found: dict[Any, Any] = {}
        self.tensors: dict[str, Any] = {}
        for path, array in leaves(world):
            key = (array.ctypes.data, array.shape, array.dtype.str) if array.size else path  # one array, one tensor
            if key not in found:
                found[key] = torch.from_numpy(_words(array)).to("cpu" if SIMULATED else "cuda")
            self.tensors[path.removeprefix("world.")] = found[key]
        if SIMULATED:
            arrays, play = tuple(named_fields(array) for _, array in leaves(world)), plain(decide)
            cut = cut_plain(world, batched)

            @cuda.jit
            def thread(given: Any, count: int) -> None:
                b = cuda.grid(1)
                if b < count:
                    play(cut(arrays, b))

            self._kernel, self._given = thread, np.zeros(1, np.int64)
        else:
            self._kernel = compiled(decide, world, batched)
            addresses = [tensor.data_ptr() for tensor in self.tensors.values()]
            self._addresses = torch.tensor(addresses, dtype=torch.int64, device="cuda")
            self._given = cuda.as_cuda_array(self._addresses)

    def play(self) -> None:
        """A decision of every environment: one launch, replayed from a CUDA graph from the second one on."""
        blocks = -(-self._count // THREADS)
        if SIMULATED:
            self._kernel[1, self._count](self._given, self._count)
            return
        cuda_of = self._torch.cuda
        if cuda_of.is_current_stream_capturing() or self._graph is None:
            stream = cuda.external_stream(cuda_of.current_stream().cuda_stream)
            self._kernel[blocks, THREADS, stream](self._given, self._count)
            if not cuda_of.is_current_stream_capturing():
                self._graph = cuda_of.CUDAGraph()
                with cuda_of.graph(self._graph):
                    stream = cuda.external_stream(cuda_of.current_stream().cuda_stream)
                    self._kernel[blocks, THREADS, stream](self._given, self._count)
        else:
            self._graph.replay()


def _words(array: Array) -> Array:
    """The array as torch takes it: records as bytes, whole numbers without a sign with one."""
    if array.dtype.names:
        return array.view(np.uint8).reshape(*array.shape, array.dtype.itemsize) if array.size else np.zeros(1, np.uint8)
    return array.view(np.int64) if array.dtype == np.uint64 else array
