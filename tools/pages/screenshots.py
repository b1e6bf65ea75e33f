"""Pictures of a report for the site, taken in the Chromium of this machine: `make screenshots`."""

from __future__ import annotations

import argparse
import importlib
import os
import shutil
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

from cps_agents.errors import CommandError
from cps_agents.files import replacing

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SHOTS = {"report": ({"width": 1280, "height": 900}, "light"), "report-phone": ({"width": 390, "height": 844}, "dark")}
MOMENT = 0.9  # of the episode
SETTLED_MS = 600.0
MARGIN = 24.0
PATIENCE_MS = 10_000.0


def browser_path() -> str:
    """Where Chromium is: CPS_ENVS_BROWSER, or the first that is found.

    Raises:
        CommandError: there is none.
    """
    path = os.environ.get("CPS_ENVS_BROWSER") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        raise CommandError("no browser was found: install chromium, or name one in CPS_ENVS_BROWSER")
    return path


def take(page: Path, pair: str, folder: Path) -> list[Path]:
    """Pictures of a problem's part of a report, with a pair open: PROBLEM/ATTACKER/DEFENDER.

    Raises:
        CommandError: there is no browser, playwright is not installed, or the report has no such pair.
    """
    try:
        api: Any = importlib.import_module("playwright.sync_api")
    except ModuleNotFoundError as error:
        raise CommandError("pictures need playwright: pip install --group browser") from error
    files, problem = [], pair.partition("/")[0]
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=["--no-sandbox"])
        for name, (size, scheme) in SHOTS.items():
            shown = browser.new_page(viewport=size, color_scheme=scheme)
            shown.goto(f"{page.resolve().as_uri()}#{quote(pair)}")
            try:
                shown.wait_for_selector(".controls input", timeout=PATIENCE_MS)
            except api.TimeoutError as error:
                raise CommandError(f"{page} has no episode of {pair}") from error
            shown.evaluate(
                f"const i = document.querySelector('.controls input'); i.value = Math.round({MOMENT} * i.max);"
                "i.dispatchEvent(new Event('input'));"
            )
            shown.wait_for_timeout(SETTLED_MS)
            with replacing(folder / f"{name}.png") as draft:
                shown.screenshot(path=str(draft), full_page=True, clip=_around(shown.locator(f"[id='{problem}']")))
            files.append(folder / f"{name}.png")
        browser.close()
    return files


def _around(part: Any) -> dict[str, float]:
    """The place of a part on the whole page, with a margin."""
    box: dict[str, float] = part.evaluate(
        "each => { const box = each.getBoundingClientRect();"
        "return { x: box.x, y: box.y + scrollY, width: box.width, height: box.height }; }"
    )
    x, y = max(box["x"] - MARGIN, 0.0), box["y"] - MARGIN
    return {"x": x, "y": y, "width": box["width"] + 2 * (box["x"] - x), "height": box["height"] + 2 * MARGIN}


def main(arguments: list[str] | None = None) -> int:
    """Take the pictures; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.pages.screenshots", description=__doc__)
    parser.add_argument("page", type=Path, help="index.html of a report")
    parser.add_argument("pair", help="that is open: PROBLEM/ATTACKER/DEFENDER")
    parser.add_argument("folder", type=Path, help="where the pictures go")
    options: Any = parser.parse_args(arguments)
    try:
        files = take(options.page, options.pair, options.folder)
    except CommandError as error:
        print(error, file=sys.stderr)
        return 2
    print(*files, sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
