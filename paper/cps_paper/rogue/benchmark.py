"""The benchmark of the rogue-vehicle problem: every analytic attacker against every defender."""

from __future__ import annotations

from dataclasses import replace

from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_envs.core.declare.panel import Contestant
from cps_paper.benchmark.schedule import Benchmark

RATIOS = (1.0, 1.3)
MAIN_RATIO = 1.0
EPISODES = 20  # of attackers and tables that draw
ATTACKERS = (
    Contestant("none"),
    Contestant("square", title="square, 0.1 Hz"),
    Contestant("slow_square", policy="square?frequency_hz=0.02", title="square, 0.02 Hz"),
    Contestant("duty_square"),
    Contestant("random", episodes=EPISODES),
    Contestant("switching"),
)
DEFENDERS = tuple(
    Contestant(name) for name in ("pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")
)
LEGEND = "damage in {unit}, means over the episodes; leader behind its reference at the end; integral of the cost c"
FORM = "{value:.1f}\n{reference_error_m:.0f} m\nc {formation_cost_s:.0f} s"


EASY = Table(
    name="easy",
    title="Easy: solid bodies, 60 s; start, onset, ratio 1 to 1.6, drive, drag and v_ref drawn; sensor noise",
    metric="damage",
    venue=Venue("rogue", "easy"),
    attackers=ATTACKERS,
    defenders=DEFENDERS,
    episodes=EPISODES,
    form=FORM,
    legend=LEGEND.format(unit="m/s"),
    only_full=True,
)


def _paper_table(power_ratio: float) -> Table:
    return replace(
        EASY,
        name=f"paper-{power_ratio:g}",
        title=f"Paper: 100 s, vehicles pass through one another, power ratio {power_ratio:g}",
        venue=Venue("rogue", "paper", {"power_ratio": power_ratio}),
        episodes=Table.episodes,
        legend=LEGEND.format(unit="m"),
    )


def _solid_table(power_ratio: float) -> Table:
    return replace(
        EASY,
        name=f"solid-{power_ratio:g}",
        title=f"The same with solid bodies, 60 s, power ratio {power_ratio:g}",
        venue=Venue("rogue", "paper", {"power_ratio": power_ratio, "contact": "solid", "duration_s": 60.0}),
        episodes=Table.episodes,
        only_full=power_ratio != MAIN_RATIO,
    )


BENCHMARK = Benchmark(
    problem="rogue",
    tables=(*map(_paper_table, RATIOS), *map(_solid_table, RATIOS), EASY),
    crash_metric="collisions",
    notes=(
        "The paper prints colours and no damage. Its attacker is `square`; `none` as a defender is `pd`.",
        "c, from 0 to 1, is half the intact vehicles' mean speed error and half their mean separation error.",
        "`switching` was searched with solid bodies against all six defenders at once, at ratios 1 and 1.3; `cps-envs "
        "reproduce ch5 --part headroom` plays those that were searched against one defender.",
        "Damages of the disbanding defenders are chaotic in single episodes: compare rows, not cells.",
    ),
)
