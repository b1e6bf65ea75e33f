"""Pictures of a report for the site, taken in the Chromium of this machine: `make screenshots`."""

from __future__ import annotations

import argparse
import importlib
import os
import shutil
import sys
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import replacing

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SHOTS = {"report": ({"width": 1280, "height": 900}, "light"), "report-phone": ({"width": 390, "height": 844}, "dark")}
MOMENT = 0.7  # of the episode
SETTLED_MS = 600.0


def browser_path() -> str:
    """Where Chromium is: CPS_ENVS_BROWSER, or the first that is found.

    Raises:
        CommandError: there is none.
    """
    path = os.environ.get("CPS_ENVS_BROWSER") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        raise CommandError("no browser was found: install chromium, or name one in CPS_ENVS_BROWSER")
    return path


def take(page: Path, problem: str, folder: Path) -> list[Path]:
    """Pictures of a report's page with the first pair of a problem open.

    Raises:
        CommandError: there is no browser, or playwright is not installed.
    """
    try:
        api: Any = importlib.import_module("playwright.sync_api")
    except ModuleNotFoundError as error:
        raise CommandError("pictures need playwright: pip install --group browser") from error
    files = []
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=["--no-sandbox"])
        for name, (size, scheme) in SHOTS.items():
            shown = browser.new_page(viewport=size, color_scheme=scheme)
            shown.goto(page.resolve().as_uri())
            shown.locator(f"#{problem} button.cell").first.click()
            shown.wait_for_selector(".controls input")
            shown.evaluate(
                f"const i = document.querySelector('.controls input'); i.value = Math.round({MOMENT} * i.max);"
                "i.dispatchEvent(new Event('input'));"
            )
            shown.wait_for_timeout(SETTLED_MS)
            with replacing(folder / f"{name}.png") as draft:
                shown.screenshot(path=str(draft), full_page=True)
            files.append(folder / f"{name}.png")
        browser.close()
    return files


def main(arguments: list[str] | None = None) -> int:
    """Take the pictures; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m cps_agents.site.screenshots", description=__doc__)
    parser.add_argument("page", type=Path, help="index.html of a report")
    parser.add_argument("problem", help="of which a pair is open")
    parser.add_argument("folder", type=Path, help="where the pictures go")
    options: Any = parser.parse_args(arguments)
    try:
        files = take(options.page, options.problem, options.folder)
    except CommandError as error:
        print(error, file=sys.stderr)
        return 2
    print(*files, sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
