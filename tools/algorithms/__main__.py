"""`python -m tools.algorithms run|page`: play the cells that are missing, and write the page."""

from __future__ import annotations

import argparse
from pathlib import Path

from tools.algorithms.cells import ROLES, kept, run
from tools.algorithms.learners import ALGORITHMS
from tools.algorithms.page import write

ROOT = Path(__file__).parents[2]
CELLS, PAGE, IMAGE = ROOT / "docs/algorithms.jsonl", ROOT / "docs/algorithms.md", ROOT / "docs/images/algorithms.svg"
LESSONS = ROOT / "tools/algorithms/lessons.md"


def main(arguments: list[str] | None = None) -> None:
    """Run what is asked."""
    parser = argparse.ArgumentParser(prog="python -m tools.algorithms", description=__doc__)
    parser.add_argument("action", choices=("run", "page"))
    parser.add_argument("--algorithm", action="append", choices=list(ALGORITHMS), help="default: all")
    parser.add_argument("--role", action="append", choices=ROLES, help="default: all")
    parser.add_argument("--seeds", type=int, default=3, help="training seeds (default: 3)")
    parser.add_argument("--cpu-seconds", type=float, default=180.0, help="of each training (default: 180)")
    parser.add_argument("--file", type=Path, default=CELLS, help="where the cells are kept")
    options = parser.parse_args(arguments)
    if options.action == "run":
        roles, algorithms = options.role or list(ROLES), options.algorithm or list(ALGORITHMS)
        run(options.file, algorithms, roles, options.seeds, options.cpu_seconds)
    else:
        write(kept(options.file), PAGE, IMAGE, LESSONS.read_text() if LESSONS.is_file() else "")


if __name__ == "__main__":
    main()
