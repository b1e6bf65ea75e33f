"""One source, two targets: a GPU's threads, here simulated, run the functions of the CPU's kernels."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec

import pytest

from cps_envs.disbanding.config import INTERPRETATIONS

HERE = "tests.disbanding.gpu_parity"


@pytest.mark.slow
@pytest.mark.skipif(find_spec("numba.cuda") is None, reason="this numba has no CUDA target: pip install numba-cuda")
def test_threads_of_a_gpu_compute_the_same_bits() -> None:
    command = [sys.executable, "-m", HERE, *INTERPRETATIONS]
    environment = os.environ | {"NUMBA_ENABLE_CUDASIM": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip().splitlines()[-1] == "{}"
