"""The generated pages of docs/.

`python -m cps_agents.docs` writes them, `--check` tells whether they are current.
"""

from __future__ import annotations

import argparse
import difflib
import sys
from pathlib import Path
from typing import Any

from cps_agents import chapters
from cps_agents.files import write_text
from cps_agents.site import environments

FOLDER = Path(__file__).parents[2] / "docs"


def pages() -> dict[str, str]:
    """The text of each page by its file name."""
    return {
        **environments.pages(),
        "chapters.md": chapters.render(),
    }


def main(arguments: list[str] | None = None) -> int:
    """Write the pages, or compare them; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m cps_agents.docs", description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing; exit code 1 if a page is out of date")
    parser.add_argument("--to", type=Path, default=FOLDER, metavar="FOLDER", help="where they are; docs/ if left out")
    options: Any = parser.parse_args(arguments)
    texts = {options.to / name: page for name, page in pages().items()}
    if options.check:
        old = [path for path, text in texts.items() if _is_old(path, text)]
        return int(bool(old))
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    return 0


def _is_old(path: Path, page: str) -> bool:
    """Whether a file is another one than this page, and a few lines on stderr that say in what."""
    written = path.read_text(encoding="utf-8") if path.exists() else ""
    if page == written:
        return False
    difference = difflib.unified_diff(written.splitlines(), page.splitlines(), "written", "current", n=0)
    print("\n".join(list(difference)[:20]), file=sys.stderr)
    print(f"{path} is out of date: run `make pages`.", file=sys.stderr)
    return True


if __name__ == "__main__":
    sys.exit(main())
