"""`cps-envs oracle --episodes`: certified impact speeds of single episodes whose starts and gains are drawn."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_agents.console import err, out, print_json
from cps_agents.table import Table

if TYPE_CHECKING:
    from cps_baselines.fdi.instances import Certificate
    from cps_envs.fdi.config import FdiConfig


def certify_episodes(
    config: FdiConfig, episodes: int, path: Path, *, time_limit_s: float, jobs: int, backend: str, as_json: bool
) -> None:
    """Certify the first evaluation episodes, keep each at once, and show them; what the file has is not done again."""
    from cps_agents.evaluation.certified import plain_values, stored_episodes
    from cps_agents.files import write_text
    from cps_agents.locking import alone_at
    from cps_agents.progress import Progress
    from cps_baselines.fdi.instances import certify_all

    with alone_at(path), Progress("episodes", episodes) as progress:
        rows = stored_episodes(path, config)
        left = [seed for seed in range(episodes) if str(seed) not in rows]
        progress.total = len(left)
        found = certify_all(config, left, time_limit_s=time_limit_s, jobs=jobs, backend=backend)
        for done, certificate in enumerate(found, 1):
            rows[str(certificate.instance.seed)] = _row(certificate)
            write_text(path, json.dumps({"config": plain_values(config), "episodes": rows}, indent=1) + "\n")
            progress.update(done, f"seed {certificate.instance.seed}: {certificate.record.status}")
    shown = {str(seed): rows[str(seed)] for seed in range(episodes)}
    if as_json:
        print_json(shown)
    else:
        _show(config, shown.items())
    err().print(f"{len(left)} episodes solved, {episodes - len(left)} known before: {path}", soft_wrap=True)
    err().print(f"`cps-envs evaluate fdi attacker --certified {path} ...` measures policies by them.", soft_wrap=True)


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


def _show(config: FdiConfig, rows: Iterable[tuple[str, Any]]) -> None:
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
    out().print(Table(title, columns, cells, left=2))
