"""The script `cps-envs`: the command line, or how to install what it needs."""

from __future__ import annotations

import sys

NEEDED = ("typer", "rich", "click")


def main() -> None:
    """Run the command line; exit code 2 where its packages are missing."""
    try:
        from cps_agents.cli import main as run
    except ModuleNotFoundError as error:
        if error.name not in NEEDED:
            raise
        print(
            f'cps-envs needs the package {error.name!r}. Install it with: pip install "cps-envs[cli]"', file=sys.stderr
        )
        sys.exit(2)
    run()
