"""What the source of a policy declares, read without importing it: that would bring numba and solvers along."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TypeAlias

IMPORT = re.compile(r"^(?:from|import)\s+([\w.]+)", re.MULTILINE)  # at the top level, as all of these
NAMES = re.compile(r"^from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)", re.MULTILINE)
DEFINITION = re.compile(r"^(?:class|def)\s+(\w+)", re.MULTILINE)
STATEMENT = re.compile(r"^[A-Za-z_@]", re.MULTILINE)
Definition: TypeAlias = ast.ClassDef | ast.FunctionDef


class UnreadableError(LookupError):
    """The source does not show what was asked for; importing the module would."""


@dataclass(frozen=True)
class Declaration:
    """A policy class, or a function that makes a policy, in the source."""

    summary: str  # first line of its docstring, or of its module's
    privileged: tuple[str, ...]  # what it needs to know beyond its observations, sorted


@dataclass(frozen=True)
class SourceNames:
    """A module's names: what it defines, and what it takes from elsewhere. Only what is asked for is parsed."""

    text: str
    places: dict[str, int]  # name -> where its definition begins
    imports: dict[str, tuple[str, str]]  # name -> the module and the name there

    @property
    def summary(self) -> str:
        """First line of the module's docstring."""
        first = STATEMENT.search(self.text)
        return _summary(ast.parse(self.text[: first.start() if first else len(self.text)]))

    def definition(self, name: str) -> Definition:
        """A class or function, which ends where the next statement begins."""
        start = self.places[name]
        after = STATEMENT.search(self.text, start + 1)
        try:
            found = ast.parse(self.text[start : after.start() if after else len(self.text)]).body[0]
        except SyntaxError:  # a line of a string looks like a statement
            named = (node for node in ast.parse(self.text).body if getattr(node, "name", "") == name)
            found = next(named)
        assert isinstance(found, Definition)
        return found


def declaration(module: str, attribute: str) -> Declaration:
    """What the source says about a policy.

    Raises:
        UnreadableError: it is neither a class nor a function, or its class names no literal set of privileges.
    """
    where, found = _definition(module, attribute)
    summary = _summary(found) or _source(where).summary
    if not summary:
        raise UnreadableError(f"{module}:{attribute} has no docstring")
    return Declaration(summary, tuple(sorted(_privileged(where, found))))


@cache
def missing_package(module: str) -> str:
    """The first package that a module needs at its top level, itself or through its own package's, and that is missing.

    Empty where nothing is missing.
    """
    waiting, seen = [module], {module}
    own = {module.partition(".")[0], "cps_envs"}
    while waiting:
        for name in _imports(waiting.pop()):
            package: str = name.partition(".")[0]
            if package not in own and not _is_there(package):
                return package
            if package in own and name not in seen and _file(name) is not None:
                seen.add(name)
                waiting.append(name)
    return ""


def _definition(module: str, name: str) -> tuple[str, Definition]:
    """A class or function and the module that defines it, which may be another one than it was asked for in."""
    source = _source(module)
    if name in source.places:
        return module, source.definition(name)
    if name in source.imports:
        return _definition(*source.imports[name])
    raise UnreadableError(f"{module} neither defines nor imports {name!r}")


def _privileged(module: str, found: Definition) -> frozenset[str]:
    """The privileges of a class, those of its first base that names some, or of the class that a function returns."""
    if isinstance(found, ast.FunctionDef):
        return _privileged(*_definition(module, _name(found.returns)))
    for statement in found.body:
        target = statement.targets[0] if isinstance(statement, ast.Assign) else getattr(statement, "target", None)
        if isinstance(target, ast.Name) and target.id == "privileged":
            return _names(statement.value)  # type: ignore[attr-defined]
    for base in found.bases:
        where, above = _definition(module, _name(base))
        if isinstance(above, ast.ClassDef) and (inherited := _privileged(where, above)):
            return inherited
    return frozenset()


def _names(value: ast.expr) -> frozenset[str]:
    """The strings of `frozenset()` or `frozenset({"model"})`."""
    if not (isinstance(value, ast.Call) and _name(value.func) == "frozenset"):
        raise UnreadableError(f"no set of names: {ast.unparse(value)}")
    try:
        return frozenset(*map(ast.literal_eval, value.args))
    except ValueError as error:
        raise UnreadableError(f"no literal names: {ast.unparse(value)}") from error


def _name(expression: ast.expr | None) -> str:
    if isinstance(expression, ast.Name):
        return expression.id
    raise UnreadableError("no plain name")


def _summary(node: Definition | ast.Module) -> str:
    return (ast.get_docstring(node) or "").partition("\n")[0]


@cache
def _source(module: str) -> SourceNames:
    text = _text(module)
    places = {found[1]: found.start() for found in DEFINITION.finditer(text)}
    imports: dict[str, tuple[str, str]] = {}
    for where, names in NAMES.findall(text):
        for name in filter(None, map(str.strip, re.sub(r"#.*", "", names).strip("()").split(","))):
            there, _, here = name.partition(" as ")
            imports[here or there] = (where, there)
    return SourceNames(text, places, imports)


@cache
def _imports(module: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(IMPORT.findall(_text(module))))


@cache
def _is_there(package: str) -> bool:
    return find_spec(package) is not None


@cache
def _text(module: str) -> str:
    path = _file(module)
    if path is None:
        raise UnreadableError(f"{module} has no source")
    return path.read_text(encoding="utf-8")


@cache
def _file(module: str) -> Path | None:
    """A module's file; asking imports the packages around it, not the module."""
    try:
        found = find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(found.origin) if found and found.origin and found.origin.endswith(".py") else None
