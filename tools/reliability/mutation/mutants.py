"""Small changes of a module's source, each of which some test should notice."""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from types import CodeType
from typing import Any

import numpy as np

SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
WIDTH = 100  # of what is shown of an expression


@dataclass(frozen=True)
class Mutant:
    """A module with one change."""

    line: int
    before: str  # the changed expression
    after: str
    code: CodeType

    @property
    def change(self) -> str:
        """In words."""
        return f"{self.before}  ->  {self.after}"


def draw(source: str, path: str, number: int, seed: int = 0) -> list[Mutant]:
    """At most so many different mutants of a source, drawn by a seed, in the order of the draw."""
    tree = ast.parse(source)
    places = list(_changes(tree))
    order = np.random.default_rng(seed).permutation(len(places))
    return [_mutant(tree, places[place], path) for place in order[:number].tolist()]


def count(source: str) -> int:
    """How many different mutants a source has."""
    return sum(1 for _ in _changes(ast.parse(source)))


def _changes(tree: ast.Module) -> Iterator[tuple[int, int]]:
    """Each place in the order of the tree, and each way to change what is there."""
    quiet = _quiet(tree)
    for place, node in enumerate(ast.walk(tree)):
        if id(node) not in quiet:
            yield from ((place, way) for way in range(len(_ways(node))))


def _mutant(tree: ast.Module, where: tuple[int, int], path: str) -> Mutant:
    (place, way), changed = where, copy.deepcopy(tree)
    node = list(ast.walk(changed))[place]
    before = _text(node)
    replacement = _ways(node)[way]
    _Exchange(node, replacement).visit(changed)
    ast.fix_missing_locations(changed)
    return Mutant(getattr(node, "lineno", 0), before, _text(replacement), compile(changed, path, "exec"))


class _Exchange(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old, self._new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self._new if node is self._old else super().generic_visit(node)


def _ways(node: ast.AST) -> list[ast.AST]:
    """What a node may become; nothing for most."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in SWAPPED:
        return [ast.copy_location(ast.Compare(node.left, [_swap(node.ops[0])], node.comparators), node)]
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        return [ast.copy_location(ast.BinOp(node.left, _swap(node.op), node.right), node)]
    if isinstance(node, ast.AugAssign) and type(node.op) in SWAPPED:
        return [ast.copy_location(ast.AugAssign(node.target, _swap(node.op), node.value), node)]
    if isinstance(node, ast.BoolOp):
        return [ast.copy_location(ast.BoolOp(_swap(node.op), node.values), node)]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub, ast.Invert)):
        return [node.operand]
    if isinstance(node, (ast.If, ast.IfExp)):
        return [_with_test(node, value) for value in (True, False)]
    if isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        return [ast.copy_location(ast.Constant(_other(node.value)), node)]
    return []


def _swap(operator: ast.AST) -> Any:
    return SWAPPED[type(operator)]()


def _with_test(node: ast.If | ast.IfExp, value: bool) -> ast.AST:
    changed = copy.copy(node)
    changed.test = ast.copy_location(ast.Constant(value), node.test)
    return changed


def _other(value: float) -> float:
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else value * 1.5 + 0.1


def _quiet(tree: ast.Module) -> set[int]:
    """Nodes that no test could notice: annotations, decorators, messages of errors, imports for types only."""
    found: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, (ast.arg, ast.AnnAssign)):
            parts.append(node.annotation)
        if isinstance(node, ast.FunctionDef):
            parts += [node.returns, *node.decorator_list]
        if isinstance(node, (ast.Raise, ast.JoinedStr, ast.Assert)):
            parts.append(node)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            parts.append(node)
        found |= {id(each) for part in parts if part is not None for each in ast.walk(part)}
    return found


def _text(node: ast.AST) -> str:
    return ast.unparse(node).splitlines()[0][:WIDTH]
