"""Options and fixtures of the whole test suite."""

from __future__ import annotations

import os
import signal
import sys

import pytest

sys.dont_write_bytecode = False  # else each process that tests start, and each that runs tests, compiles every module
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from hypothesis import HealthCheck, settings  # noqa: E402

os.environ.setdefault("CPS_ENVS_QUIET", "1")  # tests compare stderr, of processes that they start, too
os.environ.setdefault("CPS_ENVS_TRUST", "1")  # tests, and processes that they start, name code of their own

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a shell's background jobs ignore Ctrl-C, which tests press
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(  # the first example compiles kernels, or builds a table; the machine may be busy
    "suite", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write tests/golden/*.json anew; only for a new version of an environment (see CONTRIBUTING.md)",
    )
