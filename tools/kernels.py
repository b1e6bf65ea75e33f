"""Build the distribution `cps-envs-kernels`: `python -m tools.kernels FOLDER` writes its wheel.

It holds the compiled kernels of this library for x86-64-v3, this version of Python and this version of numba, see
`cps_envs.core.compute.shipped`. They are compiled anew, by what `cps-envs warm` does, in processes that numba has told
the processor's name. With `--quick` only those that the eight environments need.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import importlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from cps_envs import PROBLEMS
from cps_envs.core.compute import compiling
from cps_envs.core.compute.shipped import NATIVE, PACKAGE, PROCESSOR, package_of, runs_here
from cps_envs.core.types import ROLES

NAME = "cps-envs-kernels"
PACKAGES = ("cps_envs", "cps_baselines", "cps_agents")  # of the wheel cps-envs
PLATFORMS = {"Linux": "manylinux_2_17_x86_64", "Windows": "win_amd64"}
MACHINES = ("x86_64", "AMD64")
REMEDY = "shipped kernels are for x86-64-v3 under Linux and Windows; on other machines run `cps-envs warm`"


def first_episodes(env_ids: Iterable[str]) -> None:
    """Play an episode in each environment, as Gymnasium makes it."""
    import gymnasium

    for env_id in env_ids:
        env = gymnasium.make(env_id)
        env.action_space.seed(0)
        env.reset(seed=0)
        while not any(env.step(env.action_space.sample())[2:4]):
            pass
        env.close()


def environments() -> list[str]:
    """Gymnasium's names of the eight environments."""
    return [f"cps_envs:{problem.env_id(role)}" for problem in PROBLEMS.values() for role in ROLES]


def fill(problem: str, folder: Path, *, quick: bool) -> None:
    """Use a problem, and copy what this process has compiled for it into a folder for each package."""
    first_episodes(f"cps_envs:{PROBLEMS[problem].env_id(role)}" for role in ROLES)
    if not quick:
        from cps_agents.warm import visits, warm

        failed = warm(problem, list(visits(PROBLEMS[problem]))).failed
        if failed:
            sys.exit("\n".join(failed))
    for name in sorted({*compiling.compiled, *compiling.loaded}):
        if name.partition(".")[0] in PACKAGES and "<locals>" not in name:
            copy_kernel(name, folder)


def copy_kernel(name: str, folder: Path) -> None:
    """Copy the files of a kernel, called as in `compiling`, into the folder of its package."""
    module, _, function = name.rpartition(".")
    cache = getattr(importlib.import_module(module), function)._cache
    target = folder / package_of(module)
    target.mkdir(parents=True, exist_ok=True)
    for path in Path(cache.cache_path).glob(f"{cache._impl.filename_base}.*nb[ic]"):
        shutil.copy(path, target / path.name)


def compiled(problems: Iterable[str], folder: Path, *, quick: bool) -> None:
    """Fill a folder with the kernels of problems, each compiled in a process of its own for `PROCESSOR`."""
    with tempfile.TemporaryDirectory() as kept:
        told = {"NUMBA_CPU_NAME": PROCESSOR, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": kept, NATIVE: "1"}
        for problem in problems:
            arguments = ["--fill", problem, *(["--quick"] if quick else []), str(folder)]
            subprocess.run([sys.executable, "-m", "tools.kernels", *arguments], check=True, env=os.environ | told)


def wheel(folder: Path, target: Path) -> Path:
    """Pack a folder of kernels into the wheel of `cps-envs-kernels`; returns its path.

    Raises:
        SystemExit: this machine is none that kernels are shipped for.
    """
    if platform.machine() not in MACHINES or platform.system() not in PLATFORMS:
        sys.exit(REMEDY)
    own, python = version("cps-envs"), "{}.{}".format(*sys.version_info)
    tag = f"cp{python.replace('.', '')}-none-{PLATFORMS[platform.system()]}"
    info = f"{PACKAGE}-{own}.dist-info"
    metadata = [
        "Metadata-Version: 2.4",
        f"Name: {NAME}",
        f"Version: {own}",
        f"Summary: Compiled kernels of cps-envs for {PROCESSOR}: its first use then compiles nothing",
        f"Requires-Python: =={python}.*",
        f"Requires-Dist: cps-envs=={own}",
        f"Requires-Dist: numba=={version('numba')}",
        "License-Expression: MIT",
    ]
    files = {f"{PACKAGE}/{path.relative_to(folder).as_posix()}": path.read_bytes() for path in folder.rglob("*.nb?")}
    files[f"{PACKAGE}/__init__.py"] = b'"""Compiled kernels, see `cps_envs.core.compute.shipped`."""\n'
    files[f"{info}/METADATA"] = "\n".join([*metadata, ""]).encode()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: tools.kernels\nRoot-Is-Purelib: true\nTag: {tag}\n".encode()
    )
    files[f"{info}/RECORD"] = "".join([*map(_record, files, files.values()), f"{info}/RECORD,,\n"]).encode()
    target.mkdir(parents=True, exist_ok=True)
    path = target / f"{PACKAGE}-{own}-{tag}.whl"
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def _record(name: str, content: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def main(arguments: list[str] | None = None) -> int:
    """Compile and pack."""
    parser = argparse.ArgumentParser(prog="python -m tools.kernels", description=__doc__)
    parser.add_argument("folder", type=Path, help="where the wheel goes")
    parser.add_argument("--quick", action="store_true", help="only what the eight environments need")
    parser.add_argument("--fill", metavar="PROBLEM", choices=PROBLEMS, help=argparse.SUPPRESS)
    options: Any = parser.parse_args(arguments)
    if options.fill:
        fill(options.fill, options.folder, quick=options.quick)
        return 0
    if not runs_here():
        sys.exit(f"this processor does not know {PROCESSOR}, so that its kernels cannot be tried here; {REMEDY}")
    with tempfile.TemporaryDirectory() as kept:
        compiled(PROBLEMS, Path(kept), quick=options.quick)
        print(wheel(Path(kept), options.folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
