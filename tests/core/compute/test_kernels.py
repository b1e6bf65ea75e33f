"""The convention of the kernels: views of one environment, records of numbers, and a cache that notices edits."""

import ast
import os
import pickle
import subprocess
import sys
import textwrap
import time
from copy import deepcopy as copy_of
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from cps_envs.core.compute import compiling, kernel_cache
from cps_envs.core.compute.compiling import NOTICE, Watch, line_of
from cps_envs.core.compute.holding import hold, shapes_of
from cps_envs.core.compute.kernel_cache import UNKEPT, reach, sources_stamp
from cps_envs.core.compute.kernels import (
    borrowed,
    clip,
    copy,
    fill,
    inlined,
    kernel,
    lend,
    pack,
    record_type,
    records,
    unpack,
    view,
)
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.types import Array, FloatArray, IntArray

ROOT = Path(__file__).parents[3]
PACKAGES = ("cps_envs", "baselines", "agents", "paper")


class State(NamedTuple):
    x: FloatArray  # (B, n)
    matrix: FloatArray  # (B, n, n)
    step: IntArray  # (B,)


class Rules(NamedTuple):
    gain: float
    count: int
    flag: bool


class Shared(NamedTuple):
    offset: FloatArray  # (n,)


def make_state() -> State:
    return State(np.arange(6.0).reshape(2, 3), np.arange(18.0).reshape(2, 3, 3), np.array([4, 5]))


@inlined
def move(episode: State, r: Rules, shared: Shared) -> None:
    for i in range(episode.x.size):
        episode.x[i] += clip(r.gain * episode.matrix[i, 0], 0.0, 10.0) + shared.offset[i]
    if r.flag:
        episode.step[0] += r.count


@kernel
def move_all(state: State, rules: Array, shared: Shared) -> None:
    for b in range(state.step.size):
        move(view(state, b), unpack(Rules, rules, b), lend(shared))


@kernel
def mark(table: Array, offsets: Array, row: FloatArray) -> None:
    table[1].gain = 2.5
    at = offsets[0]
    row[at.speed + 1] = 7.0
    fill(row[at.flags : at.end], 1.0)
    copy(row[at.speed : at.flags], row[at.end : at.end + 2])


def test_view_is_one_environment_and_writes_through() -> None:
    state = make_state()
    episode = view(state, 1)
    assert isinstance(episode, State)
    episode.x[0], episode.step[0] = 9.0, 8
    assert state.x[1, 0] == 9.0
    assert state.step.tolist() == [4, 8]
    assert episode.matrix.shape == (3, 3)


def test_compiled_views_equal_those_of_python() -> None:
    compiled, plain = make_state(), make_state()
    rules = records(Rules, 2)
    rules[0], rules[1] = (1.0, 2, True), (-1.0, 3, False)
    shared = Shared(np.array([0.5, 0.0, -0.5]))
    move_all(compiled, rules, shared)
    for b in range(2):
        move.py_func(view(plain, b), unpack(Rules, rules, b), lend(shared))  # type: ignore[attr-defined]
    for ours, theirs in zip(compiled, plain, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert compiled.step.tolist() == [6, 5]


class Everything(NamedTuple):
    state: State
    shared: Shared


@kernel
def move_held(batch: Everything, rules: Array) -> None:
    for b in range(batch.state.step.size):
        move(view(batch.state, b), unpack(Rules, rules, b), lend(batch.shared))


def test_what_is_held_is_the_named_tuple_also_in_copies() -> None:
    ours, theirs = make_state(), make_state()
    rules, shared = np.repeat(pack(Rules(1.0, 2, True)), 2), Shared(np.array([0.5, 0.0, -0.5]))
    held = hold(Everything(ours, shared))
    move_all(theirs, rules, shared)
    move_held(held, rules)
    for copied in (copy_of(held), pickle.loads(pickle.dumps(held))):
        move_held(copied, rules)
        assert copied.state.step.tolist() == [8, 9]
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(mine, other)
    assert held.state.step.tolist() == [6, 7]


def test_what_is_held_tells_how_long_rows_are_and_no_axis_that_counts() -> None:
    state = State(np.zeros((2, 3)), np.zeros((2, 5, 3)), np.zeros(2, np.int64))
    assert shapes_of(state) == ((None, 3), (None, None, 3), (None,))
    absent = State(np.zeros((2, 3)), np.zeros((2, 0, 3)), np.zeros(2, np.int64))
    nested = Everything(absent, Shared(np.zeros(4)))
    assert shapes_of(nested) == (((None, 3), (None, 0, 3), (None,)), ((None,),))
    held: Any = hold(nested, told=True)
    assert held._numba_type_.shapes == shapes_of(nested)
    assert copy_of(held)._numba_type_.shapes == shapes_of(nested)
    assert hold(nested)._numba_type_.shapes == (((None,) * 2, (None,) * 3, (None,)), ((None,),))  # type: ignore[attr-defined]


@kernel
def sizes_of(batch: Everything, found: IntArray) -> None:
    episode, shared = view(batch.state, 0), lend(batch.shared)
    found[0], found[1] = batch.state.x.shape[0], episode.x.size
    found[2], found[3], found[4] = episode.matrix.shape[0], episode.matrix.size, shared.offset.size


def test_a_kernel_is_compiled_for_told_lengths_of_rows_and_one_for_all_others() -> None:
    for envs, n, told in ((2, 3, True), (5, 3, True), (1, 3, True), (2, 4, True), (2, 3, False), (1, 4, False)):
        state = State(np.zeros((envs, n)), np.zeros((envs, n + 1, n)), np.zeros(envs, np.int64))
        found = np.zeros(5, np.int64)
        sizes_of(hold(Everything(state, Shared(np.zeros(7))), told), found)
        assert found.tolist() == [envs, n, n + 1, (n + 1) * n, 7]
    assert len(sizes_of.overloads) == 3  # type: ignore[attr-defined]


def make_pair(first: str, second: str) -> Any:
    """A class with two arrays; all of these have the same name."""
    return NamedTuple("Pair", [(first, FloatArray), (second, FloatArray)])


AB, CD = make_pair("a", "b"), make_pair("c", "d")


@kernel
def second_of_ab(pair: Any) -> float:
    return pair.b[0]


@kernel
def second_of_cd(pair: Any) -> float:
    return pair.d[0]


def test_held_classes_of_one_name_are_told_apart() -> None:
    values = np.array([1.0]), np.array([2.0])
    assert second_of_ab(hold(AB(*values))) == second_of_cd(hold(CD(*values))) == 2.0


def test_records_keep_names_types_and_values() -> None:
    rules = Rules(0.1, 3, True)
    assert unpack(Rules, pack(rules), 0) == rules
    assert record_type(Rules).names == Rules._fields
    assert [record_type(Rules)[name].kind for name in Rules._fields] == ["f", "i", "b"]


def test_kernels_write_records_and_fields_by_name() -> None:
    fields = Fields(Field("speed", "m/s", 0, 1, (2,)), Field("flags", "-", 0, 1, (3,)), Field("end", "-", 0, 1, (2,)))
    table, row = records(Rules, 2), np.zeros(fields.size)
    mark(table, fields.offsets, row)
    assert table["gain"].tolist() == [0.0, 2.5]
    assert row.tolist() == [0.0, 7.0, 1.0, 1.0, 1.0, 0.0, 7.0]


def test_a_field_may_be_left_out_and_keeps_its_name() -> None:
    fields = Fields(Field("speed", "m/s", 0, 1), Field("present", "-", 0, 1, (0,)), Field("gap", "m", 0, 1))
    assert fields.offsets["present"] == fields.offsets["gap"] == 1
    assert fields.size == 2
    assert "present" not in fields.table()


def test_the_stamp_covers_what_a_module_imports_of_us() -> None:
    module = "cps_envs.disbanding.dynamics"
    __import__(module)
    assert {module, "cps_envs.core.compute.kernels", "cps_envs.disbanding.state"} <= reach(module)
    assert "cps_envs.hvac.game" not in reach(module)
    assert sources_stamp(module) != sources_stamp("cps_envs.core.compute.kernels")


def test_the_stamp_of_another_package_covers_its_own_files_and_ours() -> None:
    module = "cps_paper.testbed.robots.game"
    __import__(module)
    own = {f"cps_paper.testbed.robots.{name}" for name in ("dynamics", "controllers", "kalman", "robot", "state")}
    assert own | {"cps_envs.core.compute.kernels", "cps_envs.disbanding.dynamics"} <= reach(module)


KERNELS = """
from cps_envs.core.compute.kernels import kernel
from {package}.law import gain

@kernel
def run(x: float) -> float:
    return gain(x)

def misses() -> int:
    run(1.0)
    return sum(run.stats.cache_misses.values())
"""
LAW = """
from cps_envs.core.compute.kernels import inlined

@inlined
def gain(x: float) -> float:
    return {factor} * x
"""


def finished(folder: Path, code: str, quiet: str = "1") -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"CPS_ENVS_QUIET": quiet}
    environment.pop("NUMBA_CACHE_DIR", None)  # beside the sources
    return subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True, env=environment
    )


def outcome(folder: Path, package: str) -> list[str]:
    """What a kernel returns in a process of its own, and whether it had to be compiled."""
    code = f"from {package}.physics import run, misses; count = misses(); print(run(3.0), count)"
    return finished(folder, code).stdout.split()


@pytest.fixture
def package(tmp_path: Path) -> Path:
    package = tmp_path / "strange_problem"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "physics.py").write_text(textwrap.dedent(KERNELS.format(package=package.name)))
    (package / "law.py").write_text(LAW.format(factor=2.0))
    return package


def test_functions_inside_kernels_are_not_kept(tmp_path: Path, package: Path) -> None:
    outcome(tmp_path, package.name)
    assert {path.name.partition("-")[0] for path in package.rglob("*.nb?")} == {"physics.run"}


def test_functions_inside_kernels_raise_and_print_nothing() -> None:
    """They have no environment of numba's, which what raises by values, prints or needs Python objects would read."""
    unfit, seen = (ast.Raise, ast.Assert, ast.Try, ast.With, ast.Yield, ast.JoinedStr), 0
    paths = [path for folder in PACKAGES for path in (ROOT / folder).rglob("*.py") if "@inlined" in path.read_text()]
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef) and any(ast.unparse(d) == "inlined" for d in node.decorator_list):
                inside, seen = list(ast.walk(node)), seen + 1
                calls = {ast.unparse(each.func) for each in inside if isinstance(each, ast.Call)}
                assert not calls & {"print", "open", "eval"}, (path, node.name)
                assert not [each for each in inside if isinstance(each, unfit)], (path, node.name)
    assert seen > 300


def test_an_edit_of_an_imported_function_is_noticed(tmp_path: Path, package: Path) -> None:
    assert outcome(tmp_path, package.name) == ["6.0", "1"]
    assert outcome(tmp_path, package.name) == ["6.0", "0"]
    (package / "law.py").write_text(LAW.format(factor=5.0))
    assert outcome(tmp_path, package.name) == ["15.0", "1"]
    kept = [path for path in package.rglob("physics.run*") if path.suffix in (".nbi", ".nbc")]
    assert kept
    for path in kept:  # damaged, or of classes that have gone
        path.write_bytes(path.read_bytes()[:40])
        assert outcome(tmp_path, package.name)[0] == "15.0"


@kernel
def double_row(array: FloatArray, row: int) -> None:
    view = borrowed(array)[row]
    for i in range(view.size):
        view[i] *= 2.0


def test_what_is_borrowed_is_the_array_itself_and_stays_with_its_owner() -> None:
    array = np.arange(6.0).reshape(2, 3)
    owners = sys.getrefcount(array)
    for _ in range(3):
        double_row(array, 1)
    assert array.tolist() == [[0, 1, 2], [24, 32, 40]]
    assert sys.getrefcount(array) == owners


def test_compiling_is_announced_once_in_a_process(tmp_path: Path, package: Path) -> None:
    code = f"from {package.name}.physics import run; run(1.0); run(1)"
    assert finished(tmp_path, code, quiet="0").stderr == NOTICE + "\n"
    assert finished(tmp_path, code, quiet="0").stderr == ""


def test_while_a_kernel_is_compiled_lines_say_which_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CPS_ENVS_QUIET", "0")
    monkeypatch.setattr(compiling, "EVERY_S", 0.06)
    monkeypatch.setattr(compiling, "compiled", ["cps_envs.some.kernel"])
    watch = Watch()
    watch.begin()
    watch.on_start(None)
    watch.on_start(None)
    watch.on_end(None)
    time.sleep(0.3)
    said = capsys.readouterr().err.splitlines()
    assert len(said) >= 2
    assert all("kernel 1 of at most" in line and line.endswith("cps_envs.some.kernel") for line in said)
    watch.on_end(None)
    time.sleep(0.1)
    capsys.readouterr()
    time.sleep(0.2)
    assert capsys.readouterr().err == ""
    assert len(line_of("cps_envs." + "x" * 200, 5.0)) == 79


def test_the_file_of_another_signature_is_not_used(tmp_path: Path, package: Path) -> None:
    """Two processes that compile at once can leave the index of one with the machine code of the other."""
    code = f"from {package.name}.physics import run, misses; print(run(3.0), run(3), misses())"
    first = finished(tmp_path, code)
    assert (first.stdout, first.stderr) == ("6.0 6.0 2\n", "")  # it is not told that it compiles
    one, other = sorted(package.glob("__pycache__/physics.run-*.nbc"))
    one.write_bytes(other.read_bytes())
    assert finished(tmp_path, code).stdout == "6.0 6.0 1\n"
    assert finished(tmp_path, code).stdout == "6.0 6.0 0\n"


def doubled(x: float) -> float:
    return 2 * x


def told(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The lines on stderr without those that a busy machine adds: which kernel it compiles."""
    return [line for line in capsys.readouterr().err.splitlines() if "of at most" not in line]


def test_kernels_work_where_no_folder_can_be_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CPS_ENVS_QUIET", "0")
    monkeypatch.setattr(compiling, "told", set())
    monkeypatch.setattr(kernel_cache.Places, "_locator_classes", [kernel_cache.Nowhere])
    assert kernel(doubled)(1.5) == 3.0
    assert told(capsys) == [NOTICE, UNKEPT]


def test_a_full_disk_costs_nothing_but_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setenv("CPS_ENVS_QUIET", "0")
    monkeypatch.setattr(compiling, "told", {NOTICE})
    twice = kernel(doubled)
    monkeypatch.setattr(twice._cache._cache_file, "save", full)  # type: ignore[attr-defined]
    monkeypatch.setattr(twice._cache._cache_file, "load", lambda key: None)  # type: ignore[attr-defined]
    assert twice(2.0) == 4.0
    assert told(capsys) == [UNKEPT]
