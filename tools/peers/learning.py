"""Rows of learning: short programs of `examples/` train for a CPU minute, beside random play and the best constant."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from examples.judge import SEED, returns
from tools.peers.venvs import NOTES_AT_MOST, conflict, install, newest, python_of, versions

ROOT = Path(__file__).parents[2]
CPU_S, EPISODES, LIMIT_S = 60, 200, 900.0
CONSTANTS, TRIED_ON = 30, 50  # constant actions at most, and the episodes by which the best of them is chosen
TRIED_SEED = SEED + 50_000  # of the first of these
LEVEL = 0.95
HEAD = f"""## Learning

Each program is a short file of `examples/`. It trains the newest release of a library for {CPU_S} CPU seconds, with one
training seed. Then the network plays {EPISODES} fresh episodes. Random play and the best constant action play the same
episodes. The constant is chosen on {TRIED_ON} other episodes, among at most {CONSTANTS}.

The table gives mean returns of an episode. Its last column is the mean of paired differences with an interval of
{LEVEL:.0%} (t over the episodes). A program *learns* when the interval lies above zero. An untrained network that takes
its best action plays a constant, so its return before training may be high. One training seed and a CPU minute do not
rank libraries.

| program | role | before | after | random | best constant action | after minus random |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True)
class Program:
    """A program of `examples/`, and what it needs."""

    file: str  # without ".py"
    title: str
    venv: str
    packages: tuple[str, ...]  # what pip installs; the first must be the newest release
    role: str = "FdiAttack"
    algorithm: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)  # with which the role is judged
    note: str = ""  # an upstream reason why it fails or why its row is special

    @property
    def name(self) -> str:
        """A name for files and in the data."""
        return "-".join(part for part in (self.file, self.algorithm, self.role) if part)

    @property
    def package(self) -> str:
        """The package whose version counts."""
        return self.packages[0].partition("[")[0]


def _sb3(algorithm: str, role: str = "FdiAttack") -> Program:
    package = "stable-baselines3" if algorithm in ("PPO", "DQN", "SAC") else "sb3-contrib"
    return Program("sb3_algorithms", f"{package} {algorithm}", "sb3", (package, "stable-baselines3"), role, algorithm)


TEAM: Mapping[str, Any] = {"per_agent": True, "flat": True}
AGILERL = (
    "agilerl 2.58.0 reads the ends of episodes one step late in its generalized advantage estimation "
    "(`compute_returns_and_advantages` takes `dones[t + 1]`, and its Monte Carlo branch `dones[t]`). So pay at the end "
    "of an episode reaches no earlier decision. The program shifts the ends. Importing its PPO needs `peft`, "
    "which pip does not install with it."
)
BENCHMARL = "benchmarl 1.5.2 needs torchrl below 0.12, so it has an environment of its own."
PROGRAMS = (
    Program(
        "plain_ppo",
        "Gymnasium alone, PPO in CleanRL's style",
        "sb3",
        ("gymnasium", "torch"),
        options={"per_agent": True},
    ),
    *(_sb3(algorithm) for algorithm in ("PPO", "RecurrentPPO", "TRPO", "DQN", "QRDQN")),
    _sb3("MaskablePPO", "DisbandingAttack"),
    Program("skrl_ppo", "skrl PPO", "skrl", ("skrl", "torch")),
    Program("rllib_ppo", "RLlib PPO", "rllib", ("ray[rllib]", "torch")),
    Program("rllib_duel", "RLlib PPO, both roles", "rllib", ("ray[rllib]", "torch"), options=TEAM),
    Program("tianshou_ppo", "Tianshou PPO", "tianshou", ("tianshou",)),
    Program("evotorch_pgpe", "EvoTorch PGPE", "evotorch", ("evotorch",)),
    Program("agilerl_ppo", "AgileRL PPO", "agilerl", ("agilerl", "peft"), note=AGILERL),
    Program(
        "benchmarl_mappo",
        "BenchMARL MAPPO",
        "benchmarl",
        ("benchmarl", "torchrl<0.12"),
        "FdiDefense",
        "mappo",
        TEAM,
        BENCHMARL,
    ),
)
ABSENT = """
Three libraries have no row, because their newest releases ask for older packages than ours:

- d3rlpy 2.8.1 requires gymnasium 1.0.0 exactly; we need 1.2 or newer.
- OmniSafe 0.5.0 requires safety-gymnasium, which requires gymnasium 0.28.1 or older.
- PufferLib 3.0.0 requires gymnasium 0.29.1 or older and numpy below 2."""


def difference(after: NDArray[np.float64], other: NDArray[np.float64]) -> tuple[float, float]:
    """The mean of paired differences, and half of its interval."""
    paired = np.asarray(after, np.float64) - np.asarray(other, np.float64)
    half = stats.t.ppf((1 + LEVEL) / 2, paired.size - 1) * paired.std(ddof=1) / np.sqrt(paired.size)
    return float(paired.mean()), float(half)


def rivals(role: str, options: Mapping[str, Any], episodes: int = EPISODES) -> dict[str, list[float]]:
    """What random play and the best constant are paid in the episodes of the judgement."""
    return _rivals(role, tuple(sorted(options.items())), episodes)


@cache
def _rivals(role: str, chosen: tuple[tuple[str, Any], ...], episodes: int) -> dict[str, list[float]]:
    options = dict(chosen)
    choices = _choices(role, options)
    draws = np.random.default_rng(0)
    every = list(itertools.product(*(range(count) for count in choices)))
    if len(every) > CONSTANTS:
        every = [every[i] for i in np.sort(draws.choice(len(every), CONSTANTS, replace=False))]
    tried = [returns(role, _constant(each), TRIED_ON, TRIED_SEED, **options).mean() for each in every]
    best = every[int(np.argmax(tried))]

    def random(rows: NDArray[np.float32], action_masks: NDArray[np.bool_] | None) -> NDArray[np.int64]:
        lots = draws.random((len(rows), sum(choices)))
        if action_masks is not None:
            lots *= np.reshape(action_masks, lots.shape)
        parts = np.split(lots, np.cumsum(choices)[:-1], axis=1)
        return np.stack([part.argmax(axis=1) for part in parts], axis=1)

    return {
        "random": returns(role, random, episodes, **options).tolist(),
        "constant": returns(role, _constant(best), episodes, **options).tolist(),
    }


def _choices(role: str, options: Mapping[str, Any]) -> list[int]:
    """How many values each entry of an action has."""
    envs: Any = gymnasium.make_vec(f"cps_envs:cps_envs/{role}-v0", 1, **options)
    space = envs.single_action_space
    return [int(count) for count in np.ravel(getattr(space, "nvec", getattr(space, "n", 0)))]


def _constant(action: tuple[int, ...]) -> Callable[[NDArray[np.float32]], NDArray[np.int64]]:
    return lambda rows: np.tile(np.asarray(action, np.int64), (len(rows), 1))


def learn(program: Program, work: Path, wheel: Path | None, venvs: Path | None, *, keep: bool) -> dict[str, Any]:
    """The row of a program: in an environment of `venvs` as it is, or in one that is made with our wheel."""
    folder = (venvs or work) / program.venv
    row: dict[str, Any] = {"title": program.title, "file": program.file, "role": program.role, "note": program.note}
    row["existing"] = venvs is not None
    if wheel is not None:
        wrong = install(folder, wheel, ["--upgrade", *program.packages])
        if wrong:
            return {**row, "failed": f"installation: {wrong}"}
    row["version"] = versions(python_of(folder), [program.package])[program.package].partition("+")[0]
    offered = newest(program.package)
    if offered and offered != row["version"]:
        why = conflict(folder, wheel, program.package, offered) if wheel is not None else program.note
        because = f" because {why}" if why else ""
        return {**row, "failed": f"pip went back to {row['version']}; the newest release is {offered}{because}"}
    out = work / "learning" / f"{program.name}.json"
    if not (keep and out.is_file()):
        wrong = _train(program, python_of(folder), out)
        if wrong:
            return {**row, "failed": wrong}
    paid = json.loads(out.read_text(encoding="utf-8"))
    return {**row, **judged(paid, rivals(program.role, program.options, len(paid["after"])))}


def _train(program: Program, python: Path, out: Path) -> str:
    """Run the program; what went wrong, or ""."""
    out.parent.mkdir(parents=True, exist_ok=True)
    out.unlink(missing_ok=True)
    command = [str(python), str(ROOT / "examples" / f"{program.file}.py"), "--role", program.role]
    command += ["--algorithm", program.algorithm] if program.algorithm else []
    command += ["--cpu-seconds", str(CPU_S), "--episodes", str(EPISODES), "--out", str(out)]
    quiet = {"CPS_ENVS_QUIET": "1", "CUDA_VISIBLE_DEVICES": "", "OMP_NUM_THREADS": "1"}
    quiet["RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"] = "0"  # Ray reads CUDA_VISIBLE_DEVICES="" otherwise
    try:
        done = subprocess.run(
            command,
            cwd=out.parent,
            env={**os.environ, **quiet},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"not finished after {LIMIT_S:.0f} s"
    return "" if out.is_file() else " ".join((done.stdout + done.stderr)[-NOTES_AT_MOST:].split())


def judged(paid: Mapping[str, list[float]], beside: Mapping[str, list[float]]) -> dict[str, Any]:
    """The numbers of a row."""
    every = {**paid, **beside}
    means = {name: round(float(np.mean(each)), 4) for name, each in every.items()}
    found: dict[str, Any] = {"episodes": len(paid["after"]), **means}
    for other in ("random", "constant"):
        mean, half = difference(np.asarray(paid["after"]), np.asarray(beside[other]))
        found[f"over_{other}"] = [round(mean, 4), round(half, 4)]
    found["learns"] = found["over_random"][0] > found["over_random"][1]
    return found


def page(rows: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """The section of the page."""
    yield HEAD
    for row in rows.values():
        title = f"{row['title']} ({row['version']}): `{row['file']}.py`" if "version" in row else row["title"]
        if "failed" in row:
            yield f"| {title} | {row['role']} | | | | | does not run: {_cell(row['failed'])} |"
            continue
        numbers = " | ".join(f"{row[name]:.3f}" for name in ("before", "after", "random", "constant"))
        mean, half = row["over_random"]
        verdict = "learns" if row["learns"] else "does not learn"
        yield f"| {title} | {row['role']} | {numbers} | {verdict}: {mean:+.3f} ± {half:.3f} |"
    learned = sum(bool(row.get("learns")) for row in rows.values())
    better = sum(row["over_constant"][0] > row["over_constant"][1] for row in rows.values() if "over_constant" in row)
    yield f"\n{learned} of {len(rows)} programs learn. {better} of them also exceed the best constant action.\n"
    for row in rows.values():
        if row["note"]:
            yield f"- {row['title']}, {row['role']}: {row['note']}"
    if any(row.get("existing") for row in rows.values()):
        yield "\nRows were tried in existing environments on this source tree, not on the wheel (`--venvs`)."
    missing = [f"{each.title} ({each.role})" for each in PROGRAMS if each.name not in rows]
    if missing:
        yield f"\nNot yet tried for a minute: {', '.join(missing)}."
    yield ABSENT


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "/")[:NOTES_AT_MOST]
