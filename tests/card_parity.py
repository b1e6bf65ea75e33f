"""Run by test_card with NUMBA_ENABLE_CUDASIM=1, which numba reads when it is imported: a thread for each environment.

Plays a role on the CPU and on the simulated card, with the same actions, and prints what differs in any bit.

    python -m tests.card_parity ROLE OPPONENT DECISIONS STAGGERED [FIELD=VALUE ...]
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import torch

import cps_envs

NUM_ENVS = 3


def differing(role: str, opponent: str, decisions: int, *, staggered: bool, **settings: Any) -> list[str]:
    """What differs, decision by decision; and at last whether too few episodes have ended."""
    settings = {"opponent": opponent, **settings}
    here = cps_envs.learning_env(role, NUM_ENVS, **settings)
    there = cps_envs.learning_env(role, NUM_ENVS, device="cuda", **settings)
    options = {"staggered": staggered}
    (rows, _), (shown, _) = here.reset(seed=3, options=options), there.reset(seed=3, options=options)
    found = [] if np.array_equal(rows, shown.numpy()) else ["the first rows"]
    generator, ends = np.random.default_rng(0), 0
    for decision in range(decisions):
        actions = generator.integers(0, here.single_action_space.n, here.num_envs)  # type: ignore[attr-defined]
        rows, rewards, terminated, _, info = here.step(actions)
        shown, paid, ended, _, told = there.step(torch.from_numpy(actions))
        pairs = {"rows": (rows, shown), "rewards": (rewards, paid), "ends": (terminated, ended)}
        pairs |= {"active": (here.active(), there.active())}
        if terminated.any():
            final, final_there = info["final_info"], told["final_info"]
            pairs |= {"r": (final["episode"]["r"], final_there["episode"]["r"])}
            pairs |= {"l": (final["episode"]["l"], final_there["episode"]["l"])}
            pairs |= {"whole": (final["_episode"], final_there["_episode"])}
        found += [
            f"{name} of decision {decision}" for name, (a, b) in pairs.items() if not np.array_equal(a, b.numpy())
        ]
        ends += int(terminated.sum())
    return found if ends >= NUM_ENVS else [*found, f"only {ends} episodes have ended"]


if __name__ == "__main__":
    role, opponent, decisions, staggered, *fields = sys.argv[1:]
    settings = {name: float(value) if "." in value else int(value) for name, value in (f.split("=") for f in fields)}
    print(differing(role, opponent, int(decisions), staggered=staggered == "1", **settings))
