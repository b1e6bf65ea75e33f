"""Where compiled kernels are kept, and how the cache notices that one has to be compiled again.

Numba by itself looks at the file of a kernel alone. Most of ours are made of functions from several files, so that an
edit of one of those would go unnoticed. Here a kernel's stamp covers every file of its package that it imports,
directly or through others. What a process compiles is told by `compiling`; what need not be compiled, as it came with
the installation, by `shipped`.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.sigutils import normalize_signature

from cps_envs.core.compute.compiling import announce, declared, loaded, tell
from cps_envs.core.compute.shipped import folder_for, key_for

IMPORT = re.compile(r"^(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+([\w.]+))", re.MULTILINE)
OURS = "cps_envs"

UNKEPT = (
    "cps_envs: compiled kernels cannot be kept, because no folder for them can be written, so every process compiles "
    "them anew. Set NUMBA_CACHE_DIR to a folder that can be written."
)

Dispatcher = TypeVar("Dispatcher", bound=Callable[..., Any])


class Index(IndexDataCacheFile):
    """The index of the compiled forms that are kept of a function; one that cannot be read counts as empty.

    It names the classes of the signatures, which may have gone since it was written, or it may be damaged.
    """

    def _load_index(self) -> Any:
        try:
            return super()._load_index()  # type: ignore[no-untyped-call]
        except Exception:  # whatever a file of unknown content does to pickle
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)  # type: ignore[no-untyped-call]
        except Exception as error:
            raise OSError(f"{name} cannot be read: {error}") from error  # numba then compiles anew


class Nowhere:
    """Where kernels go if no folder for them can be written: nothing is kept."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> Nowhere:
        """One for every function."""
        return cls(function)

    def get_cache_path(self) -> str:
        """No folder."""
        return os.devnull

    def get_source_stamp(self) -> str:
        """None is needed, see `SourceCache`."""
        return ""

    def get_disambiguator(self) -> str:
        """The line of the function, as numba has it in the names of files."""
        return str(self._line)

    def ensure_cache_path(self) -> None:
        """Raises OSError: there is nothing to write to."""
        raise OSError("no folder for compiled kernels can be written")


class Places(CompileResultCacheImpl):
    """Where numba keeps the kernels of a function."""

    _locator_classes: list[Any] = [*CompileResultCacheImpl._locator_classes, Nowhere]


class SourceCache(FunctionCache):
    """Numba's cache of a function, valid for the sources of everything that the function's module imports of us."""

    _impl_class = Places

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        stamp = sources_stamp(function.__module__)
        self._cache_file = Index(self._cache_path, self._impl.filename_base, stamp)  # type: ignore[no-untyped-call]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function for a signature, kept or shipped; None if there is none, and numba then compiles it.

        Two processes that compile at once may write the same file for different signatures: the last one stays, and
        the other one's is not used but compiled again.
        """
        found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if not _is_for(found, sig):
            found = self._shipped(sig, target_context)
        if not _is_for(found, sig):
            return announce(name_of(self._py_func))
        loaded.append(name_of(self._py_func))
        return found

    def _shipped(self, sig: Any, target_context: Any) -> Any:
        """The function of the distribution with compiled kernels, if it has it for these sources."""
        if (folder := folder_for(self._py_func.__module__)) is None:
            return None
        file: Any = Index(str(folder), self._impl.filename_base, self._cache_file._source_stamp)  # type: ignore[no-untyped-call]
        key = self._index_key(sig, target_context.codegen())  # type: ignore[no-untyped-call]
        data = file.load(key_for(key))
        return data and self._impl.rebuild(target_context, data)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function; a full or read-only disk costs time at the next start, nothing else."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError:
            tell(UNKEPT)


def _is_for(found: Any, sig: Any) -> bool:
    """Whether what was loaded is a function for a signature."""
    return found is not None and tuple(found.signature.args) == tuple(normalize_signature(sig)[0])  # type: ignore[no-untyped-call]


def cache_by_sources(dispatcher: Dispatcher) -> Dispatcher:
    """Give a jitted function a `SourceCache`; one without a file, from a prompt say, is compiled anew each time."""
    function = dispatcher.py_func  # type: ignore[attr-defined]
    declared.append(name_of(function))
    if Path(function.__code__.co_filename).is_file():
        dispatcher._cache = SourceCache(function)  # type: ignore[attr-defined]
    return dispatcher


def name_of(function: Callable[..., Any]) -> str:
    """How a kernel is called in what is told of it."""
    return f"{function.__module__}.{function.__qualname__}"


def sources_stamp(module: str) -> str:
    """A digest of a module's source and of all modules of its own package and of `cps_envs` that it reaches."""
    digest = hashlib.sha256()
    for name in sorted(reach(module)):
        digest.update(name.encode() + b"\0" + source(name) + b"\0")
    return digest.hexdigest()


def reach(module: str) -> set[str]:
    """The modules of a module's own package and of `cps_envs` that it imports at its top level, and theirs, and so on.

    Modules that are not loaded yet do not count: a kernel can only use what is.
    """
    packages = {module.partition(".")[0], OURS}
    found, waiting = {module}, [module]
    while waiting:
        for name in imports(waiting.pop()):
            if name not in found and name in sys.modules and name.partition(".")[0] in packages:
                found.add(name)
                waiting.append(name)
    return found


@functools.cache
def source(module: str) -> bytes:
    """The source of a loaded module; nothing where it has no file."""
    path = getattr(sys.modules[module], "__file__", None)
    return Path(path).read_bytes() if path and Path(path).is_file() else b""


@functools.cache
def imports(module: str) -> tuple[str, ...]:
    """What the top level of a module imports: modules, names that may be modules, and where names come from."""
    return tuple(_imported(source(module).decode("utf-8", "replace")))


def _imported(text: str) -> Iterator[str]:
    for package, names, plain in IMPORT.findall(text):
        if plain:
            yield plain
        else:
            yield package
            for name in re.findall(r"\w+", names):
                found = vars(sys.modules[package]).get(name) if package in sys.modules else None
                yield found.__name__ if isinstance(found, ModuleType) else getattr(found, "__module__", package)
                yield f"{package}.{name}"
