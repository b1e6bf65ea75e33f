"""The checkers of Gymnasium, PettingZoo and stable-baselines3, with their warnings as errors."""

from __future__ import annotations

import contextlib
import importlib
import io
import warnings
from collections.abc import Iterator
from typing import Any

from gymnasium.utils.env_checker import check_env

from cps_envs.core.conformance.recording import episode_steps
from cps_envs.core.conformance.subject import NotApplicableError, Subject
from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.interfaces.aec_env import RolesAECEnv

HARMLESS = (  # attacker and defender differ by nature
    "Agents have different (observation|action) space sizes",
    "Observations are different shapes",
    "Action space for each agent probably should be",  # MultiDiscrete
    "We recommend agents to be named",  # a team's are defender_vehicle_1
    ".*the option 'options' of reset is unknown",  # which PettingZoo's test gives
)


def check_gymnasium(subject: Subject) -> None:
    """`gymnasium.utils.env_checker.check_env`; rendering is checked by `check_rendering`, without a display."""
    with _strict("gymnasium's check_env"):
        check_env(subject.single(), skip_render_check=True)


def check_pettingzoo(subject: Subject) -> None:
    """PettingZoo's `parallel_api_test` and `parallel_seed_test` of both roles and the swarm; turn-based, `api_test`."""
    tests: Any = importlib.import_module("pettingzoo.test")
    interfaces = subject.interfaces()
    for name in ("parallel", "swarm"):
        if name in interfaces:
            cycles = min(episode_steps(interfaces[name]()), 100)
            with _strict(f"PettingZoo's tests of the {name} interface"):
                tests.parallel_api_test(interfaces[name](), num_cycles=cycles)
                tests.parallel_seed_test(interfaces[name], num_cycles=cycles)
    with _strict("PettingZoo's test of the turn-based form"):
        tests.api_test(RolesAECEnv(subject.parallel()), num_cycles=min(2 * episode_steps(subject.parallel()), 100))


def check_stable_baselines3(subject: Subject) -> None:
    """`stable_baselines3.common.env_checker.check_env`.

    Raises:
        NotApplicableError: stable-baselines3 is not installed.
    """
    try:
        checker = importlib.import_module("stable_baselines3.common.env_checker")
    except ImportError as error:
        raise NotApplicableError(f"stable-baselines3 is not installed: {error}") from error
    with _strict("stable-baselines3's check_env"):
        checker.check_env(subject.single(), warn=True, skip_render_check=True)


@contextlib.contextmanager
def _strict(what: str) -> Iterator[None]:
    """Errors and warnings of foreign checkers as AssertionError, their prints unheard."""
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore", DeprecationWarning)
            warnings.simplefilter("error", UserWarning)
            warnings.simplefilter("ignore", ForeignSettingWarning)  # of a configuration, not of an interface
            for message in HARMLESS:
                warnings.filterwarnings("ignore", message)
            yield
    except Exception as error:
        raise AssertionError(f"{what} objects: {_one_line(error)}") from error


def _one_line(error: Any) -> str:
    return " ".join(str(error).split()) or repr(error)
