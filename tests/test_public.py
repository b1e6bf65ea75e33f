"""The public interface: what `__all__` names can be had, and documents and examples import nothing else of ours."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("cps_envs", "cps_baselines", "cps_agents")
SNIPPET = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def programs(path: Path) -> Iterator[str]:
    """The Python of a document, a notebook or an example."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from SNIPPET.findall(text)
    elif path.suffix == ".ipynb":
        cells = (cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code")
        yield from ("".join(line for line in cell["source"] if not line.startswith(("%", "!"))) for cell in cells)
    else:
        yield text


def taken(program: str) -> Iterator[tuple[str, str]]:
    """Each of our modules that a program imports, with the name that it takes from it, empty for all."""
    for node in ast.walk(ast.parse(program)):
        if isinstance(node, ast.Import):
            yield from ((each.name, "") for each in node.names if each.name.partition(".")[0] in PACKAGES)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in PACKAGES:
            yield from ((str(node.module), each.name) for each in node.names)


def public(module: str, name: str) -> bool:
    package, _, inner = module.partition(".")
    asked = inner or name
    return (
        asked in ("", *import_module(package).__all__) or re.fullmatch(r"\w+_v\d+", asked) is not None
    )  # PettingZoo's


SHOWN = [
    *(path for path in (ROOT / "docs").rglob("*") if path.suffix in (".md", ".ipynb") and "paper" not in path.stem),
    *(ROOT / "examples").glob("*.py"),
    ROOT / "README.md",
]


@pytest.mark.parametrize("path", SHOWN, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_documents_and_examples_import_public_names_only(path: Path) -> None:
    inner = [each for program in programs(path) for each in taken(program) if not public(*each)]
    assert not inner


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_there_and_typed(package: str) -> None:
    module = import_module(package)
    declared = {
        alias.asname or alias.name
        for node in ast.walk(ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(module.__all__) - {"__version__"} <= declared
    for name in module.__all__:
        if name not in ("sb3", "torchrl"):  # they need another library
            assert getattr(module, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = module.nothing


def test_importing_the_packages_loads_no_kernels() -> None:
    program = f"import {', '.join(PACKAGES)}, sys; print(*(name for name in ('numba', 'torch') if name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "\n"


@pytest.mark.parametrize("package", PACKAGES)
def test_the_api_page_has_every_public_name(package: str) -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    public = [name for name in import_module(package).__all__ if not name.startswith("__")]
    assert [name for name in public if f"{package}.{name}" not in page] == []
