"""What a card plays and how fast: equality with the CPU bit for bit, then decisions per second. Two minutes on an H100.

    python -m tools.gpu [--quick]

Prints one JSON object. Without a card it says so; `tests/test_card.py` shows what can be shown without one.
"""

from __future__ import annotations

import json
import platform
import sys
import time
from importlib.metadata import version
from typing import Any

import numpy as np

import cps_envs

EQUAL = (  # role, opponent
    ("FdiAttack", "cusum"),
    ("FdiAttack", "chi2"),
    ("FdiAttack", 'mixture?policies=["none","chi2","cusum"]'),
    ("RogueAttack", "none"),
)
FAST = (("FdiAttack", "cusum"), ("RogueAttack", "none"))
SIZES = (1_024, 8_192, 65_536)
EPISODES, DECISIONS, SECONDS = 64, 60, 3.0


def equality(role: str, opponent: str, decisions: int) -> dict[str, Any]:
    """How many rows, rewards and ends of so many decisions of 64 episodes differ in any bit, of how many."""
    import torch

    here = cps_envs.learning_env(role, EPISODES, opponent=opponent)
    there = cps_envs.learning_env(role, EPISODES, opponent=opponent, device="cuda")
    began = time.perf_counter()
    (rows, _), (shown, _) = here.reset(seed=0), there.reset(seed=0)
    seconds, generator = time.perf_counter() - began, np.random.default_rng(0)
    differ, most, ended = int((rows != shown.cpu().numpy()).sum()), 0.0, 0
    for _ in range(decisions):
        actions = generator.integers(0, here.single_action_space.n, here.num_envs)  # type: ignore[attr-defined]
        rows, rewards, ends, _, _ = here.step(actions)
        shown, paid, over, _, _ = there.step(torch.from_numpy(actions).cuda())
        for mine, theirs in ((rows, shown), (rewards, paid), (ends, over)):
            other = theirs.cpu().numpy()
            differ += int((mine != other).sum())
            most = max(most, float(np.abs(mine.astype(float) - other.astype(float)).max()))
        ended += int(ends.sum())
    found = {"differing numbers": differ, "largest difference": most, "ended episodes": ended}
    return {"role": role, "opponent": opponent, **found, "seconds to compile and start": round(seconds, 1)}


def speed(role: str, opponent: str, num_envs: int, device: str) -> dict[str, Any]:
    """Decisions and game steps per second under random actions."""
    import torch

    env: Any = cps_envs.learning_env(role, num_envs, opponent=opponent, device=device)
    env.reset(seed=0, options={"staggered": False})
    on_card = device == "cuda"
    count = env.single_action_space.n
    actions: Any = np.random.default_rng(0).integers(0, count, num_envs)
    if on_card:
        actions = torch.from_numpy(actions).cuda()
    env.step(actions)
    if on_card:
        torch.cuda.synchronize()
    began, played = time.perf_counter(), 0
    while time.perf_counter() - began < SECONDS:
        for _ in range(10 if on_card else 1):
            env.step(actions)
            played += num_envs
        if on_card:
            torch.cuda.synchronize()
    rate = played / (time.perf_counter() - began)
    steps = rate * env.frame_skip * env.game.decision_interval[env.role]
    where = {"role": role, "device": device, "episodes": num_envs}
    return {**where, "decisions/s": round(rate), "game steps/s": round(steps)}


def main() -> None:
    """Print the record."""
    quick = "--quick" in sys.argv[1:]
    try:
        cps_envs.learning_env("FdiAttack", 2, device="cuda")
    except (cps_envs.ConfigurationError, cps_envs.MissingExtraError) as error:
        raise SystemExit(str(error)) from None
    import torch

    names = ("numba", "numba-cuda", "numpy", "torch")
    record: dict[str, Any] = {
        "card": torch.cuda.get_device_name(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in names},
        "equality": [equality(*pair, 10 if quick else DECISIONS) for pair in EQUAL],
        "speed": [],
    }
    for role, opponent in FAST:
        for num_envs in SIZES[:1] if quick else SIZES:
            record["speed"].append(speed(role, opponent, num_envs, "cuda"))
        record["speed"].append(speed(role, opponent, 256, "cpu"))
    print(json.dumps(record, indent=1))


if __name__ == "__main__":
    main()
