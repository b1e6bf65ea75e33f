"""`python -m tools.hvac.optimum` prints the strongest stealthy attack on MTD2 in `paper`, and its bound."""

from __future__ import annotations

import argparse

from cps_envs.hvac.problem import HVAC
from tools.hvac.played import OpenLoop, impact_played
from tools.hvac.program import respond, solve

DAYS = 20
MARGIN = 0.02  # of the bias, for the noise that the mean field leaves out


def main() -> None:
    """Print a table with a row for each number of compromised sensors; it takes half a minute."""
    argparse.ArgumentParser(prog="python -m tools.hvac.optimum", description=main.__doc__).parse_args()
    print(f"A_impact in C2 against MTD2; played on {DAYS} days: brink, and the optimum with {MARGIN:.0%} less bias")
    print("| sensors | brink | optimum played | mean-field optimum | its bound |")
    print("|---|---|---|---|---|")
    for count in (1, 2, 3):
        config = HVAC.config("paper", {"num_compromised": count})
        response = respond(config)
        found = solve(response)
        attack = OpenLoop(config, response.sensors, (1.0 - MARGIN) * response.biases(found.b))
        played = [f"{impact_played(config, each, DAYS):.1f}" for each in ("brink", attack)]
        print(f"| {count} | {' | '.join(played)} | {found.impact_c2:.2f} | {found.bound_c2:.2f} |", flush=True)


if __name__ == "__main__":
    main()
