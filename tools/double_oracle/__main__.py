"""`python -m tools.double_oracle`: the value of the rogue game between fixed laws and searched attackers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from cps_agents.arena.statistics import Estimate
from cps_agents.commands.options import AsJson
from cps_agents.console import note, out, print_json
from cps_agents.files import alone_at, write_json
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_baselines.rogue.switching import SIZE
from cps_envs.core.documents import read_entry
from tools.command import run
from tools.double_oracle.fixed_game import DEFENDERS, FixedGame
from tools.double_oracle.rounds import Round, Row, fresh_value, play_rounds

LEAST_SHARE = 0.05  # of a defender that the table names
MOST = 10**9  # of the whole numbers in a file


def double_oracle(
    ratio: Annotated[list[float] | None, typer.Option(help="Power ratio; may be repeated. Default: 1 and 1.3.")] = None,
    weight: Annotated[float, typer.Option(min=0, help="Weight of the formation cost beside the damage, m/s2.")] = 0.5,
    rounds: Annotated[int, typer.Option(min=1, help="Play so many rounds in all; a file with fewer continues.")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the searches.")] = 0,
    to: Annotated[Path, typer.Option("--out", help="Keep every attack in this file; a later call continues.")] = Path(
        "double-oracle.json"
    ),
    as_json: AsJson = False,
) -> None:
    """Solve the rogue game of the paper between fixed control laws and switching attackers.

    The defender mixes 504 fixed choices: a law for each of the four intact
    vehicles, or detection. Each round solves the matrix game, searches a
    switching attack on the defender's mixture, and adds it. At the end both
    mixtures are valued in worlds that did not choose them. That value is a
    lower bound: the last response says how far it may still rise.
    """
    games = [FixedGame(each, weight, seed=seed) for each in ratio or (1.0, 1.3)]
    found: list[dict[str, Any]] = []
    with alone_at(to), Progress("rounds", rounds * len(games)) as progress:
        kept = {_key(game): rows for game, rows in _read(to)}
        for game in games:
            rows, done = kept.setdefault(_key(game), []), list[Round]()
            for each in play_rounds(game, rows, rounds):
                done.append(each)
                progress.update(len(found) * rounds + len(done), f"ratio {game.power_ratio:g}: {each.value:.1f} m/s")
                write_json(to, {"games": [_stored(key, rows) for key, rows in kept.items()]})
            found.append(_document(game, done, fresh_value(game, rows, done[-1])))
    if as_json:
        print_json(found)
    else:
        for game, solved in zip(games, found, strict=True):
            _show(game, solved)
    note(f"Written: {to}")


def _key(game: FixedGame) -> str:
    return json.dumps(asdict(game), sort_keys=True)


def _stored(key: str, rows: Sequence[Row]) -> dict[str, Any]:
    plain = [{"attack": row.attack.tolist(), "paid": [round(float(each), 3) for each in row.paid]} for row in rows]
    return {"game": json.loads(key), "rows": plain}


def _read(path: Path) -> list[tuple[FixedGame, list[Row]]]:
    """What an earlier call has found.

    Raises:
        DamagedFileError: the file is something else, or of other defenders.
    """
    if not path.is_file():
        return []
    document = read_entry(path, "file of a double oracle", "Choose another --out, or delete it.")
    found = []
    for each in document["games"].rows():
        game = each["game"]
        ratio, weight = game["power_ratio"].number(0), game["weight_mps2"].number(0)
        whole = (game[name].whole(0, MOST) for name in ("worlds", "population", "generations", "seed"))
        rows = [
            Row(np.array(row["attack"].numbers(SIZE)), np.array(row["paid"].numbers(len(DEFENDERS))))
            for row in each["rows"].rows()
        ]
        found.append((FixedGame(ratio, weight, *whole), rows))
    return found


def _document(game: FixedGame, rounds: Sequence[Round], value: Estimate) -> dict[str, Any]:

    last = rounds[-1]
    return {
        "game": asdict(game),
        "value": {"mean": value.mean, "low": value.low, "high": value.high},
        "value_of_means": last.value,
        "response": last.response,
        "least": last.least,
        "defender": {
            name: float(share) for name, share in zip(DEFENDERS, last.defender, strict=True) if share > LEAST_SHARE
        },
        "rounds": [{"value": each.value, "response": each.response, "least": each.least} for each in rounds],
    }


def _show(game: FixedGame, found: dict[str, Any]) -> None:
    title = f"Power ratio {game.power_ratio:g}, {game.weight_mps2:g} m/s2 of formation cost, m/s"
    rows = [
        [str(number), *(f"{each[name]:.1f}" for name in ("value", "response", "least"))]
        for number, each in enumerate(found["rounds"], 1)
    ]
    out().print(Sheet(title, ("round", "value", "next response", "best single defender"), rows))
    shares = ", ".join(f"{name} {share:.0%}" for name, share in found["defender"].items())
    value = found["value"]
    ends = f"95 % interval {value['low']:.1f} to {value['high']:.1f}"
    out().print(f"Value in {game.fresh_worlds} fresh worlds: {value['mean']:.1f} m/s, {ends}.")
    out().print(f"The defender plays {shares}", markup=False, soft_wrap=True)


if __name__ == "__main__":
    run(double_oracle, "python -m tools.double_oracle")
