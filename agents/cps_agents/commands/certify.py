"""`cps-envs certify`: certified impact speeds of false data injection, of tasks or of single episodes.

The starts and gains of those episodes (`--episodes`) are drawn.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.commands.options import AsJson, AtCluster, Changes, Config, described, workers
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_at, write_text
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_agents.workers import Where, Workers
from cps_baselines.fdi.sweep import Certificate, certify_all, open_tasks, paper_tasks, sweep
from cps_envs.core.declare.objective import is_own
from cps_envs.core.documents import Entry, read_entry
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import (
    FASTEST_MPS,
    KIND,
    REMEDY,
    ROUNDING_MPS,
    STATUSES,
    Record,
    constants,
    from_entry,
    to_text,
)
from cps_envs.fdi.problem import FDI
from cps_envs.fdi.task import Task, parse_task


def certify(
    preset: Annotated[
        str | None, typer.Option(help="Use this preset of the problem fdi, such as paper or drawn.")
    ] = None,
    file: Config = None,
    settings: Changes = None,
    task: Annotated[
        list[str] | None,
        typer.Option(help="Sensors and target, such as 'x4>4'; may be repeated. Default: every cell of the tables."),
    ] = None,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Certify the first evaluation episodes, as in preset 'drawn'.")
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(min=0.0, metavar="SECONDS", help="Time for each task, or each episode; 0: no search."),
    ] = 20.0,
    gap: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Stop at this relative gap; 0 proves the optimum.")
    ] = 0.0,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Solve so many tasks at a time; default: as many as cores.")
    ] = None,
    cluster: AtCluster = None,
    improve: Annotated[bool, typer.Option("--improve", help="Continue with tasks that are not proved.")] = False,
    to: Annotated[
        Path | None,
        typer.Option("--out", help="Write this file and continue from it; default: results/certificates/PRESET.json."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the highest impact speed that false data injection can reach, with a bound that proves it.

    Tasks of one vehicle are mostly proved, by an exhaustive search in a reduced basis; what stays open has a gap. For
    each task you get the bound with continuous injections (LP), the speed of the best attack found, and a bound that no
    attack exceeds. Press Ctrl-C at any time: finished tasks are kept, and the same command continues.
    """
    preset, values = described(FDI, preset, file, settings)
    if preset is None:
        raise CommandError("name what is certified: --preset NAME, such as paper or drawn, or in the --config file")
    config = FDI.config(preset, values)
    if not is_own(config):
        raise CommandError("certificates are of the impact speed: leave `payoff` out")
    limits: dict[str, Any] = {"time_limit_s": time_limit, "where": workers(jobs, cluster)}
    if episodes is not None:
        path = to or Path("results") / "certificates" / f"{preset}-episodes.json"
        certify_episodes(config, episodes, path, **limits, as_json=as_json)
        return
    tasks = tasks_named(task or (), config.num_vehicles)
    path = to or Path("results") / "certificates" / f"{preset}.json"
    certify_tasks(config, tasks, path, **limits, gap=gap, improve=improve, as_json=as_json)


def tasks_named(texts: Iterable[str], num_vehicles: int) -> Sequence[Task]:
    """The tasks of texts such as "x4>4 v4>4", each once; every cell of the tables where there is none."""
    named = (parse_task(text, num_vehicles) for each in texts for text in each.split())
    return list(dict.fromkeys(named)) or paper_tasks(num_vehicles)


def certify_tasks(
    config: FdiConfig, tasks: Sequence[Task], path: Path, *, improve: bool, where: Where, as_json: bool, **limits: Any
) -> None:
    """Certify tasks within the limits of `sweep`, keep each at once, and show them; what the file has stays."""
    with alone_at(path):
        known, earlier = _earlier(path, config)
        left = open_tasks(tasks, known, improve=improve)
        header = _header(earlier)
        with Progress("tasks", len(left)) as progress, Workers(where) as pool:
            for done, record in enumerate(sweep(config, left, dict(known), run=pool.run, **limits), 1):
                known[record.task] = record
                write_text(path, to_text(header, config, known.values()))
                progress.update(done, f"{record.task}: {record.status}")
    chosen = [known[wanted] for wanted in tasks]
    if as_json:
        print_json(json.loads(to_text(header, config, chosen)))
    else:
        _show(config, chosen)
    note(f"{len(left)} tasks solved, {len(chosen) - len(left)} known before: {path}")


def _earlier(path: Path, config: FdiConfig) -> tuple[dict[Task, Record], dict[str, Any]]:
    """The records that a file holds already, the commands that found them and what was before; nothing without one.

    Raises:
        DamagedFileError: it holds something else.
        CommandError: it holds optima of another configuration.
    """
    if not path.exists():
        return {}, {}
    document = read_entry(path, KIND, REMEDY)
    values, records = from_entry(document)
    differing = [name for name, value in constants(config).items() if values.get(name) != value]
    if differing:
        raise CommandError(
            f"{path} holds optima of another configuration ({', '.join(differing)}). Name another file with --out, or "
            "delete it."
        )
    commands, before = document.get("commands"), document.get("before")
    header: dict[str, Any] = {} if before is None else {"before": before.text()}
    return records, {**header, "commands": [] if commands is None else [each.text() for each in commands.rows()]}


def _header(earlier: dict[str, Any]) -> dict[str, Any]:
    command, commands = describe()["command"], earlier.get("commands", [])
    commands = [*commands, command] if command not in commands[-1:] else commands
    versions = {package: version(package) for package in ("cps-envs", "highspy", "numpy")}
    return {**earlier, "commands": commands, "versions": versions}


def _show(config: FdiConfig, records: list[Record]) -> None:
    columns = ("Task", "Status", "LP", "Value", "Bound", "Gap %", "Time s")
    rows = [_cells(record) for record in records]
    title = f"Impact speed in m/s, {config.num_vehicles} vehicles, {config.horizon} steps of {config.dt_s:g} s"
    console = out()
    console.print(Sheet(title, columns, rows, left=2))
    reachable = sum(record.lp_mps is not None for record in records)
    found, closed = (sum(getattr(record, name) for record in records) for name in ("feasible", "closed"))
    console.print(
        f"{len(records)} tasks: {reachable} reachable with continuous injections, {found} with a known attack, "
        f"{closed} closed (proved or infeasible)."
    )


def _cells(record: Record) -> tuple[str, ...]:
    def number(value: float | None, digits: int) -> str:
        return "-" if value is None else f"{value:.{digits}f}"

    gap = None if record.gap is None else 100 * record.gap
    speeds = (number(value, 4) for value in (record.lp_mps, record.value_mps, record.bound_mps))
    return (str(record.task), record.status, *speeds, number(gap, 2), number(record.wall_s, 1))


def certify_episodes(
    config: FdiConfig, episodes: int, path: Path, *, time_limit_s: float, where: Where, as_json: bool
) -> None:
    """Certify the first evaluation episodes, keep each at once, and show them; what the file has is not done again."""
    with alone_at(path), Progress("episodes", episodes) as progress, Workers(where) as pool:
        rows = stored_episodes(path, config)
        left = [seed for seed in range(episodes) if str(seed) not in rows]
        progress.total = len(left)
        found = certify_all(config, left, time_limit_s=time_limit_s, run=pool.run)
        for done, certificate in enumerate(found, 1):
            rows[str(certificate.instance.seed)] = _row(certificate)
            write_text(path, json.dumps({"config": plain_values(config), "episodes": rows}, indent=1) + "\n")
            progress.update(done, f"seed {certificate.instance.seed}: {certificate.record.status}")
    shown = {str(seed): rows[str(seed)] for seed in range(episodes)}
    if as_json:
        print_json(shown)
    else:
        _show_episodes(config, shown.items())
    note(f"{len(left)} episodes solved, {episodes - len(left)} known before: {path}")


def stored_episodes(path: Path, config: Any) -> dict[str, Any]:
    """The certified episodes of a file, by seed; none where there is no file.

    Raises:
        DamagedFileError: it holds something else.
        CommandError: it holds episodes of another configuration.
    """
    if not path.exists():
        return {}
    document = read_entry(path, "file of certified episodes", "Name another file with --out, or delete it.")
    same, rows = document["config"].value == plain_values(config), document["episodes"].entries()
    if not same:
        raise CommandError(
            f"{path} holds episodes of another configuration. Name another file with --out, or delete it."
        )
    for row in rows.values():
        _check(row)
    return document["episodes"].plain()


def _check(row: Entry) -> None:
    """Check that a row has what is read from it, as `cps-envs certify --episodes` wrote it."""
    row["task"].text()
    row["status"].text(STATUSES)
    row["wall_s"].number(0)
    bound_mps = row["bound_mps"].number(0, FASTEST_MPS)
    if row["value_mps"].value is not None:
        row["value_mps"].number(0, bound_mps + ROUNDING_MPS)
    if row["lp_mps"].value is not None:
        row["lp_mps"].number(0, FASTEST_MPS)
    for gain in row["gains"].rows():
        gain.number()


def plain_values(config: Any) -> Any:
    """A configuration as the file has it."""
    return json.loads(json.dumps(asdict(config)))


def _row(certificate: Certificate) -> dict[str, Any]:
    instance, record = certificate
    return {
        "task": str(instance.task),
        "start": list(instance.start),
        "gains": list(instance.gains),
        "lp_mps": record.lp_mps,
        "value_mps": record.value_mps,
        "bound_mps": record.bound_mps,
        "status": record.status,
        "wall_s": round(record.wall_s, 2),
        "injections": None if record.injections is None else record.injections.tolist(),
    }


def _show_episodes(config: FdiConfig, rows: Iterable[tuple[str, Any]]) -> None:
    columns = ("Seed", "Task", "k_p", "k_d", "Status", "LP", "Value", "Bound", "Time s")
    cells = [
        (
            seed,
            row["task"],
            *(f"{gain:.3f}" for gain in row["gains"]),
            row["status"],
            *("-" if row[name] is None else f"{row[name]:.4f}" for name in ("lp_mps", "value_mps", "bound_mps")),
            f"{row['wall_s']:.1f}",
        )
        for seed, row in rows
    ]
    title = f"Impact speed in m/s without a defender, episodes of up to {config.horizon} steps of {config.dt_s:g} s"
    out().print(Sheet(title, columns, cells, left=2))
