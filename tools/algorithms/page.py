"""The page of the table: `docs/algorithms.md` with one figure, from the file of cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import t

from tools.algorithms.cells import ROLES, Cell, track_of
from tools.algorithms.learners import ALGORITHMS


def mean_and_half(cells: Sequence[Cell]) -> tuple[float, float]:
    """Mean of the scores over training seeds and half of its 95 % interval; of one seed that over episodes."""
    scores = np.array([cell.score for cell in cells])
    if len(scores) == 1:
        return float(scores[0]), cells[0].half_width
    spread = scores.std(ddof=1) / np.sqrt(len(scores))
    return float(scores.mean()), float(t.ppf(0.975, len(scores) - 1) * spread)


def table(cells: Sequence[Cell]) -> list[str]:
    """Algorithms x tracks in Markdown; the best of a track is bold."""
    found = {
        (name, role): [cell for cell in cells if (cell.algorithm, cell.role) == (name, role) and not cell.failed]
        for name in ALGORITHMS
        for role in ROLES
    }
    best = {
        role: max((mean_and_half(found[name, role])[0] for name in ALGORITHMS if found[name, role]), default=np.nan)
        for role in ROLES
    }
    lines = ["| | " + " | ".join(f"`{track_of(role)}`" for role in ROLES) + " |", "|---|" + "---|" * len(ROLES)]
    for name in ALGORITHMS:
        entries = []
        for role in ROLES:
            if not found[name, role]:
                entries.append("–")
                continue
            mean, half = mean_and_half(found[name, role])
            shown = f"{mean:.0f} ± {half:.0f}"
            entries.append(f"**{shown}**" if mean == best[role] else shown)
        lines.append(f"| {name} | " + " | ".join(entries) + " |")
    return lines


def draw(cells: Sequence[Cell], image: Path) -> None:
    """Training returns over CPU seconds, a plot for each role, as SVG."""
    figure, axes = plt.subplots(2, len(ROLES) // 2, figsize=(13, 6), layout="constrained")
    for role, plot in zip(ROLES, axes.flat, strict=True):
        for place, name in enumerate(ALGORITHMS):
            for cell in cells:
                if (cell.algorithm, cell.role) == (name, role) and cell.curve:
                    spent, returns = zip(*cell.curve, strict=True)
                    plot.plot(spent, returns, color=f"C{place}", lw=1.2, label=name if cell.seed == 0 else None)
        values = [value for cell in cells if cell.role == role for _, value in cell.curve]
        if values:
            plot.set_ylim(np.percentile(values, 4), max(values) + 0.05 * np.ptp(values))
        plot.set_title(role, fontsize=10)
        plot.set_xlabel("CPU seconds", fontsize=8)
        plot.tick_params(labelsize=8)
    handles = {label: line for plot in axes.flat for line, label in zip(*plot.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(ALGORITHMS), fontsize=8)
    figure.savefig(image, metadata={"Date": None})


def write(cells: Mapping[Any, Cell], page: Path, image: Path, lessons: str) -> None:
    """The page, whose part between two lines of comments is written anew, and the figure."""
    chosen = list(cells.values())
    draw(chosen, image)
    budgets = sorted({cell.cpu_s for cell in chosen})
    seeds = sorted({cell.seed for cell in chosen})
    failed = sorted({f"- {cell.algorithm}, {cell.role}: {cell.failed}" for cell in chosen if cell.failed})
    lines = [
        "# Which algorithm learns what",
        "",
        f"Each algorithm trains on each role for {' or '.join(f'{each:.0f}' for each in budgets)} CPU seconds of one "
        f"core, with {len(seeds)} training seed{'s' * (len(seeds) > 1)}. The numbers are scores of "
        "[challenge v1](challenge.md) on split test: 0 is the best policy that never looks, 100 the reference. "
        "Settings were chosen before, on split dev, and are the same for all tracks. The interval is over training "
        "seeds, or over episodes where there is one.",
        "",
        *table(chosen),
        "",
        f"![Training returns over CPU seconds](images/{image.name})",
        "",
        lessons.strip(),
        "",
        "## Settings",
        "",
        *(f"- **{name}**: {algorithm.words}" for name, algorithm in ALGORITHMS.items()),
        "",
        "SAC and TD3 need continuous actions, and no role has them by default: the continuous adapters begin as a "
        "controller plays, or move one vehicle each.",
        "",
        *([*failed, ""] if failed else []),
        "`python -m tools.algorithms run` plays the cells that are missing, `page` writes this page.",
        "",
    ]
    page.write_text("\n".join(lines))
