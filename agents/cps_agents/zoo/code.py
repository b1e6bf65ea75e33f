"""Code and files of one's own that a policy depends on, known by their content without running any of it."""

from __future__ import annotations

import ast
import hashlib
import re
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import Any

from cps_envs.core.documents import MOST_BYTES
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.policies.reference import texts_in

COVERED = ("cps_envs", "cps_baselines")  # by the hash of our own code
AGENTS = "cps_agents"
INSTALLED = ("site-packages", "dist-packages")  # folders of packages that have a version
LONGEST = 255  # of a text that may name a file
CLASSES = re.compile(r"<class '([\w.]+)'>|\"__module__\": \"([\w.]+)\"")  # in a model of stable-baselines3
IMPORTERS = ("import_module", "__import__")


def hashes_of_code(modules: Iterable[str]) -> dict[str, str]:
    """Hashes of some modules, of what they import in turn and of files that their texts name, by `module:` or `file:`.

    What lies in `site-packages` counts only if it is among `modules`, and of this package nothing else does. A file is
    named by its path from here, or from the module's own folder.

    Raises:
        UnknownNameError: there is no such module, or it has no files.
    """
    named = [each for each in dict.fromkeys(modules) if _top(each) not in COVERED]
    units = dict.fromkeys(map(_unit, named))
    found, reached, texts = {unit: _files(unit) for unit in units}, set[Path](), dict[str, set[Path]]()
    left = list(named)
    while left:
        for path, package in _parts(left.pop()).items():
            if path in reached:
                continue
            reached.add(path)
            tree = _tree(path)
            for text in _texts(tree):
                for file in {path.parent / text, Path(text)}:
                    if _is_file(file):
                        texts.setdefault(text, set()).add(file.resolve())
            for name in _imported(tree, package):
                if _is_own(_top(name)):
                    found.setdefault(_top(name), _files(_top(name)))
                    left.append(name)
    code = {f"module:{name}": hash_of(files) for name, files in found.items()}
    return code | {f"file:{text}": hash_of(sorted(files)) for text, files in sorted(texts.items())}


def hashes_of_files(options: Mapping[str, Any]) -> dict[str, str]:
    """Hashes of the files and folders that the options of a policy name, by `file:`."""
    found = {}
    for text in texts_in(list(options.values())):
        path = Path(text)
        if _is_file(path):
            found[f"file:{text}"] = hash_of([path])
        elif text and _is_folder(path):
            found[f"file:{text}"] = hash_of(sorted(each for each in path.rglob("*") if each.is_file()), path)
    return found


def modules_of_model(path: Path) -> list[str]:
    """The modules of one's own that a model of stable-baselines3 has classes of, such as its extractor of features."""
    try:
        with zipfile.ZipFile(path) as archive, archive.open("data") as data:
            text = data.read(MOST_BYTES).decode("utf-8", "replace")
    except (OSError, KeyError, zipfile.BadZipFile):  # what loads it says so
        return []
    names = (each for pair in CLASSES.findall(text) for each in pair if each)
    return sorted({name for name in names if _is_own(_top(name))})


def hash_of(files: Iterable[Path], folder: Path | None = None) -> str:
    """A hash of the contents of files, and of their names within a folder."""
    digest = hashlib.sha256()
    for file in files:
        if folder is not None:
            digest.update(file.relative_to(folder).as_posix().encode())
        with file.open("rb") as opened:
            while block := opened.read(2**20):
                digest.update(block)
    return digest.hexdigest()[:16]


def _top(module: str) -> str:
    return module.partition(".")[0]


def _unit(module: str) -> str:
    """What is hashed for a module: the whole package that it is in, of ours the module alone."""
    return module if _top(module) == AGENTS else _top(module)


def _spec(module: str) -> ModuleSpec | None:
    try:
        return find_spec(module)
    except (ImportError, ValueError):  # such as of `__main__`
        return None


def _is_own(top: str) -> bool:
    """Whether a module, or a package, is neither Python's nor installed, nor ours."""
    if not top or top in sys.stdlib_module_names or top in (*COVERED, AGENTS):
        return False
    spec = _spec(top)
    if spec is None:
        return False
    places = [*(spec.submodule_search_locations or ())] or ([spec.origin] if spec.has_location and spec.origin else [])
    return bool(places) and not any(part in INSTALLED for place in places for part in Path(place).parts)


def _files(unit: str) -> list[Path]:
    """The Python files of a module or package; a top-level one is found without being imported.

    Raises:
        UnknownNameError: there is no such module, or it has no files.
    """
    spec = _spec(unit)
    if spec is None:
        made = getattr(sys.modules.get(unit), "__file__", None)
        if made is not None:
            return [Path(made)]
        raise UnknownNameError(f"there is no module {unit!r} with files, so whether it changed cannot be told")
    if folders := spec.submodule_search_locations:
        return sorted(file for folder in folders for file in Path(folder).rglob("*.py"))
    return [Path(spec.origin)] if spec.origin is not None and spec.has_location else []


def _parts(module: str) -> dict[Path, str]:
    """The files that importing `a.b.c` runs, with the package of each; `c` may be an attribute of a module."""
    top, *rest = module.split(".")
    spec = _spec(top)
    folders = None if spec is None else spec.submodule_search_locations
    if not folders:
        known = spec is not None or top in sys.modules
        return {path: "" for path in (_files(top) if known else []) if path.suffix == ".py"}
    found = {}
    for folder in map(Path, folders):
        for depth in range(len(rest) + 1):
            within = folder.joinpath(*rest[:depth])
            found[within / "__init__.py"] = ".".join([top, *rest[:depth]])
            if depth:
                found[within.with_name(f"{within.name}.py")] = ".".join([top, *rest[: depth - 1]])
    return {path: package for path, package in found.items() if path.is_file()}


def _tree(path: Path) -> ast.AST:
    try:
        return ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError):  # importing it says so
        return ast.Module([], [])


def _texts(tree: ast.AST) -> Iterator[str]:
    """The texts in code that may name a file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and 0 < len(node.value) <= LONGEST:
            yield node.value


def _imported(tree: ast.AST, package: str) -> Iterator[str]:
    """The modules that code in a package imports anywhere, with attributes as if they were modules."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = f"{'.' * node.level}{node.module or ''}"
            try:
                whole = resolve_name(name, package) if node.level else name
            except ImportError:
                continue
            yield from (f"{whole}.{each.name}" for each in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if called in IMPORTERS and isinstance(node.args[0].value, str):
                yield node.args[0].value.lstrip(".")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or with odd characters
        return False


def _is_folder(path: Path) -> bool:
    """Whether it is one that does not hold the working directory, which nobody means."""
    try:
        return path.is_dir() and not Path.cwd().is_relative_to(path.resolve())
    except (OSError, ValueError):
        return False
