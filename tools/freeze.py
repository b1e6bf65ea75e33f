"""What users see, as bytes: `python -m tools.freeze FOLDER` writes it, and `diff -r` tells what a change has changed.

`trajectories.json` holds a digest of every number of the golden episodes, `files.json` one of each published file,
`list.json` what `cps-envs list --json` prints, and `help/` the help text of every command.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium

from cps_envs import PROBLEMS, trust
from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import has_ended

ROOT = Path(__file__).parents[1]
PUBLISHED = ("docs/reproduction.json", "agents/cps_agents/scoring/v1/*.json", "tests/golden/*.json")
COLUMNS = "100"


def trajectories() -> dict[str, str]:
    """SHA-256 of all observations, rewards and metrics of each golden episode, bit for bit."""
    from tests.settings import tests_of

    trust()  # the players of some golden episodes lie in tests/
    cases = [(name, case, golden) for name in PROBLEMS for case, golden in tests_of(name).golden.items()]
    return {f"{name}/{case}": _digest_of_episode(name, golden) for name, case, golden in cases}


def _digest_of_episode(name: str, golden: Any) -> str:
    env_id = f"cps_envs:{PROBLEMS[name].env_id(golden.role)}"
    env: Any = gymnasium.make(env_id, interface="native", **golden.kwargs).unwrapped
    crew = Crew(env, golden.seed, golden.boldness)
    digest = hashlib.sha256()
    result: tuple[Any, ...] = env.reset(seed=golden.seed)
    while True:
        *numbers, info = result
        digest.update(numbers[0].tobytes())
        digest.update(json.dumps(numbers[1:]).encode())
        metrics = {key: value for key, value in info.items() if key not in ("action_mask", "cost")}
        digest.update(json.dumps(metrics).encode())
        if len(result) > 2 and has_ended(env, result):
            return digest.hexdigest()
        result = env.step(crew.act(info))


def files() -> dict[str, str]:
    """SHA-256 of the files that are published and compared with."""
    paths = sorted(path for pattern in PUBLISHED for path in ROOT.glob(pattern))
    return {str(path.relative_to(ROOT)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def said(*arguments: str) -> str:
    """What the command line prints."""
    from typer.testing import CliRunner

    from cps_agents.cli import app

    return CliRunner().invoke(app, arguments, prog_name="cps-envs").output


def commands() -> Iterator[tuple[str, ...]]:
    """The words of every command and of every group of them."""
    from cps_agents.cli import whole

    def below(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
        yield words
        for name, part in getattr(command, "commands", {}).items():
            yield from below(part, (*words, name))

    yield from below(whole(), ())


def main(arguments: list[str] | None = None) -> None:
    """Write the folder."""
    parser = argparse.ArgumentParser(prog="python -m tools.freeze", description=__doc__)
    parser.add_argument("folder", type=Path, help="write to this folder")
    parser.add_argument("--quick", action="store_true", help="leave the golden episodes out")
    options = parser.parse_args(arguments)
    os.environ |= {"COLUMNS": COLUMNS, "TERMINAL_WIDTH": COLUMNS, "NO_COLOR": "1"}
    folder: Path = options.folder
    (folder / "help").mkdir(parents=True, exist_ok=True)
    for words in commands():
        (folder / "help" / f"{'-'.join(('cps-envs', *words))}.txt").write_text(said(*words, "--help"))
    (folder / "list.json").write_text(said("list", "--json"))
    _write(folder / "files.json", files())
    if not options.quick:
        _write(folder / "trajectories.json", trajectories())


def _write(path: Path, found: dict[str, str]) -> None:
    path.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
