"""One source, two devices: what a GPU would run compiles for one, and plays the CPU's episodes bit for bit."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pkgutil import walk_packages
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import cps_envs
from cps_envs import PROBLEMS, ConfigurationError
from cps_envs.core.compute.holding import HolderType
from cps_envs.core.compute.kernels import kernel, least, nearest, room
from cps_envs.core.types import ROLES, Array

needs_numba_cuda = pytest.mark.skipif(find_spec("numba_cuda") is None, reason="pip install numba-cuda[cu13]")
SIMULATOR = os.environ | {"NUMBA_ENABLE_CUDASIM": "1"}


def simulated(*words: str) -> str:
    """The last line of `tests.card_parity` in a process of its own."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.card_parity", *words]
    done = subprocess.run(command, env=SIMULATOR, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().splitlines()[-1]


@needs_numba_cuda
@pytest.mark.slow  # plain Python: 5 CPU seconds each
@pytest.mark.parametrize(
    "words",
    [
        ("FdiAttack", "cusum", "7", "0", "horizon=30"),
        ("FdiAttack", 'mixture?policies=["none","chi2","cusum"]', "7", "1", "horizon=45"),
    ],
    ids=["cusum", "a mixture, staggered"],
)
def test_threads_of_a_simulated_card_play_the_episodes_of_the_cpu(words: tuple[str, ...]) -> None:
    assert simulated(*words) == "[]"


@needs_numba_cuda
@pytest.mark.slow
def test_threads_play_rogue_too() -> None:
    code = (
        "from tests.card_parity import differing\n"
        'print(differing("RogueAttack", "none", 25, staggered=False, duration_s=1.0, frame_skip=1, onset_s=(0.0, 0.2)))'
    )
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, env=SIMULATOR, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "[]", done.stderr


def kernels_of(problem: str) -> dict[str, Any]:
    """The kernels in the modules of a problem, by module and name."""
    package = import_module(f"cps_envs.{problem}")
    found = {}
    for entry in walk_packages(package.__path__, f"{package.__name__}."):
        if ".picture" in entry.name or ".pages" in entry.name:
            continue
        module = import_module(entry.name)
        for name, each in vars(module).items():
            whole = hasattr(each, "py_func") and each.targetoptions.get("no_cpython_wrapper") is None
            if whole and each.py_func.__module__ == module.__name__:
                found[f"{entry.name}.{name}"] = each
    return found


def play_both(problem: Any, preset: str) -> None:
    """Let the kernels of a game meet their arguments: a reset and some steps of both roles."""
    for role in ROLES:
        env: Any = cps_envs.registration.learning_env(problem.env_id(role), 2, preset=preset, interface="learning")
        env.reset(seed=0, options={"staggered": False})
        env.step(np.stack([env.single_action_space.sample() for _ in range(env.num_envs)]))


def on_a_card(kind: Any) -> Any:
    """The type of an argument, held tuples as what they hold."""
    return kind.named if isinstance(kind, HolderType) else kind


@needs_numba_cuda
@pytest.mark.slow  # a minute or so each: every kernel is compiled for a GPU, without having one
@pytest.mark.parametrize("problem", sorted(PROBLEMS))
def test_every_kernel_compiles_for_a_gpu(problem: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from numba.cuda import dispatcher

    from cps_envs.core.compute import gpu

    if gpu.SIMULATED:
        pytest.skip("the simulator compiles nothing")
    card = SimpleNamespace(compute_capability=(9, 0))
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: card)
    for preset in PROBLEMS[problem].presets:
        if preset in ("paper", "learning"):
            play_both(PROBLEMS[problem], preset)
    refused, compiled = {}, []
    for name, each in kernels_of(problem).items():
        for signature in each.nopython_signatures[:1]:
            kinds = tuple(map(on_a_card, signature.args))
            try:
                text, _ = gpu.cuda.compile_ptx(each.py_func, kinds, cc=(9, 0), device=True)
            except Exception as error:  # all that a compiler may raise
                refused[name] = str(error)[-300:]
            else:
                assert "alloca" not in text, name
                compiled.append(name)
    assert not refused
    assert len(compiled) >= 3


@needs_numba_cuda
def test_without_a_card_one_sentence_says_so() -> None:
    from cps_envs.core.compute import gpu

    if gpu.SIMULATED or gpu.cuda.is_available():
        pytest.skip("there is a card")
    with pytest.raises(ConfigurationError, match="needs an NVIDIA card"):
        cps_envs.learning_env("FdiAttack", 4, device="cuda")


def test_another_device_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='must be "cpu" or "cuda"'):
        cps_envs.learning_env("FdiAttack", 4, device="tpu")


@needs_numba_cuda
@pytest.mark.parametrize(
    ("role", "settings", "names"),
    [
        ("FdiAttack", {"opponent": "bank"}, "Bank cannot come along"),
        ("FdiDefense", {}, "the adapter 'sensor' does not play on a GPU"),
        ("HvacAttack", {}, "does not play on a GPU"),
    ],
)
def test_what_cannot_come_along_is_named(role: str, settings: dict[str, Any], names: str) -> None:
    from cps_envs.core.learning.card import check_side

    env = cps_envs.learning_env(role, 2, **settings)
    with pytest.raises(ConfigurationError, match=names):
        check_side(env._match, env._side)  # type: ignore[arg-type]


@needs_numba_cuda
def test_each_private_door_of_numba_cuda_is_there() -> None:
    """One check for each of `gpu.HOOKS`."""
    from cps_envs.core.compute import gpu

    if gpu.SIMULATED:
        pytest.skip("the simulator has none of them")
    assert hasattr(np, "row_stack")
    driver = import_module("numba.cuda.cudadrv.driver")
    assert driver.LinkerOptions is gpu.Unfused
    options = gpu.Unfused(arch="sm_90", link_time_optimization=True)
    assert "-fma=0" in options._prepare_nvjitlink_options()
    assert b"-fma=0" in options._prepare_nvjitlink_options(as_bytes=True)
    arrays = import_module("numba.cuda.np.arrayobj")
    assert callable(arrays.make_array)
    assert callable(arrays.populate_array)
    target = import_module("numba.cuda.target").CUDATypingContext
    assert "Dispatcher" in target.resolve_value_type.__code__.co_names or hasattr(target, "resolve_value_type")
    assert len(gpu.HOOKS) == 4


@kernel
def sums_in_rooms(values: Array, total: Array) -> None:
    own, whole = room(values.shape[1]), room((2, 3), np.int64)
    whole[1, 2] = 1
    for b in range(values.shape[0]):
        for i in range(own.size):
            own[i] = 2.0 * values[b, i]
        total[b, 0], total[b, 1] = least(own) + whole[1, 2], nearest(own[0])


def test_rooms_hold_what_is_put_into_them() -> None:
    values, total = np.array([[0.25, -1.0], [0.75, 3.0]]), np.zeros((2, 2))
    sums_in_rooms(values, total)
    assert total.tolist() == [[-1.0, 0.0], [2.5, 2.0]]  # 0.5 and 1.5 lie between two whole numbers


def test_nearest_is_rint() -> None:
    values = np.concatenate([np.arange(-6, 6.25, 0.25), [0.49999999999999994, 1e9 + 0.5, -2.5000001]])
    assert [nearest(value) for value in values] == np.rint(values).tolist()
