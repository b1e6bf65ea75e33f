"""Where compiled kernels are kept, and how the cache notices that one has to be compiled again.

Numba by itself looks at the file of a kernel alone. Most of ours are made of functions from several files, so that an
edit of one of those would go unnoticed. Here a kernel's stamp covers every file of its package that it imports,
directly or through others.
"""

from __future__ import annotations

import functools
import hashlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from numba.core.caching import FunctionCache

IMPORT = re.compile(r"^(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+([\w.]+))", re.MULTILINE)
OURS = "cps_envs"

Dispatcher = TypeVar("Dispatcher", bound=Callable[..., Any])


class SourceCache(FunctionCache):
    """Numba's cache of a function, valid for the sources of everything that the function's module imports of us."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file._source_stamp = sources_stamp(function.__module__)


def cache_by_sources(dispatcher: Dispatcher) -> Dispatcher:
    """Give a jitted function a `SourceCache`; one without a file, from a prompt say, is compiled anew each time."""
    function = dispatcher.py_func  # type: ignore[attr-defined]
    if Path(function.__code__.co_filename).is_file():
        dispatcher._cache = SourceCache(function)  # type: ignore[attr-defined]
    return dispatcher


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
    """What the top level of a module imports: modules, and names that may be modules."""
    return tuple(_imported(source(module).decode("utf-8", "replace")))


def _imported(text: str) -> Iterator[str]:
    for package, names, plain in IMPORT.findall(text):
        if plain:
            yield plain
        else:
            yield package
            yield from (f"{package}.{name}" for name in re.findall(r"\w+", names))
