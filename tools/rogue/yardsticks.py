"""The best attacks that three unlike searches know against each controller: what attackers are compared with.

`python -m tools.rogue.yardsticks` prints the tables of `yardsticks.json` beside this module.
`python -m tools.rogue.yardsticks FILE` searches what FILE does not hold yet, a quarter of an hour of CPU time,
and prints its tables. Interrupted, the same command goes on.

1. A switching law, see `switching_search`.
2. Identification: a probe of 5.2 s, then the law that was searched from there on, by what the probe has shown; and the
   same for an attacker that is told the controller.
3. A plan by beam search on copies of the world, see `beam`.

All three are lower bounds of what an attacker can do.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from tools.rivals.rogue import DEFENDERS
from tools.rogue.switching import DEFENDERS as CONTROLLERS
from tools.rogue.yardstick_searches import contest_attacks, identified, plan_attack, search_answer, search_law

Document = dict[str, Any]
RATIOS = (1.0, 1.1, 1.2, 1.3)
CONTESTED = tuple(each for each in DEFENDERS if each.name != "none")  # which is `pd`
SEARCHES = ("switching", "untold", "told", "beam")


def shipped() -> Document:
    """The result that comes with the package."""
    found: Document = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
    return found


def best_known(found: Document, ratio: float, controller: str) -> float:
    """The largest damage (m/s) that any of the searches does to a controller of chapter 5."""
    return max(damage_of(found, search, ratio, controller) for search in SEARCHES)


def damage_of(found: Document, search: str, ratio: float, controller: str) -> float:
    """The damage (m/s) of one search; that of a plan at the step at which it does less."""
    if search in ("untold", "told"):
        return float(found[f"identify {ratio:g}"][search][controller])
    cell = found[f"{search} {ratio:g} {controller}"]
    return float(min(cell["damage"], cell.get("refined", cell["damage"])))


def complete(found: Document) -> Iterator[str]:
    """Search what is missing; gives the name of each piece after it is there."""
    for name, work in _pieces(found):
        if name not in found:
            found[name] = work()
            yield name


def _pieces(found: Document) -> Iterator[tuple[str, Callable[[], Any]]]:
    """All there is to do, in an order in which each piece finds what it needs."""
    for ratio in RATIOS:
        for name in CONTROLLERS:
            law, answer = f"switching {ratio:g} {name}", f"answer {ratio:g} {name}"
            yield law, partial(search_law, name, ratio)
            yield answer, partial(_answer, found, law, name, ratio)
            yield f"beam {ratio:g} {name}", partial(plan_attack, name, ratio)
        yield f"identify {ratio:g}", partial(_identify, found, ratio)
    for defender in CONTESTED:
        yield f"learning {defender.name}", partial(contest_attacks, defender.reference)


def _answer(found: Document, law: str, name: str, ratio: float) -> Document:
    return search_answer(name, ratio, found[law]["weights"])


def _identify(found: Document, ratio: float) -> dict[str, dict[str, float]]:
    return identified(ratio, {name: found[f"answer {ratio:g} {name}"] for name in CONTROLLERS})


def tables(found: Document) -> Iterator[str]:
    """The lines of both tables, for the documentation."""
    yield "| ratio | controller | switching law | identify | the same, told | beam | best known |"
    yield "|---|---|---|---|---|---|---|"
    for ratio, name in product(RATIOS, CONTROLLERS):
        shown = [damage_of(found, search, ratio, name) for search in SEARCHES]
        yield f"| {ratio:g} | `{name}` | {' | '.join(f'{each:.1f}' for each in [*shown, max(shown)])} |"
    yield ""
    yield "| defender of `learning` | best switching law | `identify` | beam | best known |"
    yield "|---|---|---|---|---|"
    for defender in CONTESTED:
        cell = found[f"learning {defender.name}"]
        shown = [cell["law"], cell["identify"], cell["beam"]]
        values = " | ".join(f"{each:.1f}" for each in [*shown[1:], max(shown)])
        yield f"| `{defender.name}` | {shown[0]:.1f} {cell['chosen']} | {values} |"


def main(path: Path | None) -> None:
    """Complete a file if one is given, and print the tables."""
    if path is None:
        print("\n".join(tables(shipped())))
        return
    found: Document = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    total, started = len(list(_pieces(found))), time.monotonic()
    for name in complete(found):
        draft = path.with_suffix(".draft")
        draft.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        os.replace(draft, path)
        print(f"{len(found)}/{total} after {time.monotonic() - started:.0f} s  {name}", file=sys.stderr, flush=True)
    print("\n".join(tables(found)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser("python -m tools.rogue.yardsticks", description=main.__doc__)
    parser.add_argument("file", nargs="?", type=Path, help="search what this JSON lacks, and keep it there")
    main(parser.parse_args().file)
