"""Training seeds and meetings of a league side by side on a Ray cluster.

    ray start --head                                            # or join a cluster
    python examples/ray_cluster.py train RogueAttack-v0 --seeds 16 --out /shared/runs
    python examples/ray_cluster.py train hvac-defense --seeds 5 --out /shared/runs
    python examples/ray_cluster.py league rogue --episodes 100 --out /shared/meetings
    ray job submit -- python examples/ray_cluster.py train ...  # from outside

Any recipe of `cps-envs train` does: our own PPO, or policy search with cma-es. Runs and meetings are plain data.
`--out` has to be a folder that every machine of the cluster sees. What is finished there is not done again.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import ray

from cps_agents import Recipe, Store, TrainingJob, Venue, Workers, asked, attempt, changed, find_recipe, learn, line_up


def spread(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """Items with their results as they get done, one task of one CPU for each."""
    remote = ray.remote(num_cpus=1)(function)
    waiting = {remote.remote(item): item for item in items}
    while waiting:
        (done, *_), _ = ray.wait(list(waiting), num_returns=1)
        yield waiting.pop(done), ray.get(done)


def train_everywhere(recipe: Recipe, seeds: int, folder: Path) -> None:
    """One task per training seed, whatever the recipe's algorithm."""
    jobs = [
        TrainingJob(recipe, seed, folder / recipe.name / f"seed-{seed}", "examples/ray_cluster.py", resume=True)
        for seed in range(seeds)
    ]
    for job, found in spread(learn, jobs):
        print(f"seed {job.seed}: {found['steps']:,} steps, best validation {found['best_score']:.4g}, {job.folder}")


def play_everywhere(problem: str, episodes: int, folder: Path) -> None:
    """One task per meeting; `cps-envs league PROBLEM --episodes N --meetings FOLDER` then finds them all played."""
    store = Store(folder)
    with Workers(1) as pool:
        table, _ = line_up(asked(Venue(problem, "learning"), {}, episodes), {}, store, pool)
    meetings = [table.meeting(pair) for pair in table.pairs]
    for meeting, result in spread(attempt, [meeting for meeting in meetings if store.get(meeting) is None]):
        store.put(meeting, result)
        returns = result["metrics"]["return"]
        print(f"{meeting.attacker} against {meeting.defender}: {sum(returns) / len(returns):.3f}")


def main() -> None:
    """Train or play."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", choices=("train", "league"))
    parser.add_argument("name", help="a recipe or environment to train, a problem to play")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--steps", type=int, help="of each seed, as in `cps-envs train`; the recipe's own if left out")
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    ray.init(ignore_reinit_error=True)
    if args.work == "train":
        recipe = find_recipe(args.name)
        train_everywhere(
            recipe if args.steps is None else changed(recipe, {"total_timesteps": args.steps}), args.seeds, args.out
        )
    else:
        play_everywhere(args.name, args.episodes, args.out)


if __name__ == "__main__":
    main()
