"""TorchRL's wrappers of single environments and duels, our batch of duels, and self-play in it."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.types import ROLES

pytest.importorskip("torchrl")
IDS = sorted(str(env_id) for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
# TorchRL reads a MultiDiscrete of one entry as a number, which NumPy 2.4 refuses to convert: two attacked sensors.
OPTIONS = {"cps_envs/FdiAttack-v0": {"attacked": "xv4"}}
SHORT: dict[str, dict[str, Any]] = {"rogue": {"duration_s": 6.0}, "fdi": {}}


@pytest.mark.parametrize("env_id", IDS)
def test_single_environments(env_id: str) -> None:
    """`GymEnv(id)` of all ids"""
    from torchrl.envs import GymEnv
    from torchrl.envs.utils import check_env_specs

    env = GymEnv(env_id, **OPTIONS.get(env_id, {}))
    check_env_specs(env)
    reward = env.rollout(5)["next", "reward"]
    assert np.isfinite(reward.numpy()).all()


@pytest.mark.parametrize("name", PROBLEMS)
def test_duels(name: str) -> None:
    """`PettingZooWrapper` of all duels"""
    from torchrl.envs import PettingZooWrapper
    from torchrl.envs.utils import check_env_specs

    # TorchRL makes one array of the masks of a MultiDiscrete, whose entries have to be of one size.
    native = {"interface": "native"} if name == "disbanding" else {}
    check_env_specs(PettingZooWrapper(import_module(f"cps_envs.{name}_v0").parallel_env(**native), use_mask=True))


def duel(problem: str, num_envs: int = 3, **options: Any) -> Any:
    from cps_agents.torchrl import DuelEnv

    return DuelEnv(problem, num_envs, **{**SHORT[problem], **options})


@pytest.mark.parametrize("problem", SHORT)
def test_torchrl_accepts_it(problem: str) -> None:
    from torchrl.envs.utils import check_env_specs

    check_env_specs(duel(problem))


def test_continuous_actions_and_roles_of_different_pace() -> None:
    from torchrl.envs.utils import check_env_specs

    from cps_agents.torchrl import DuelEnv

    adapters = {"attacker": "timed", "defender": "follow_road"}
    check_env_specs(DuelEnv("disbanding", 2, adapters=adapters, duration_s=60.0))


def test_a_team_sees_what_the_vector_environment_shows() -> None:
    """A batch of a team: TorchRL accepts it, and an agent sees what its row of `make_vec` does."""
    import torch
    from torchrl.envs.utils import check_env_specs

    from cps_agents.torchrl import TeamEnv

    team = TeamEnv("fdi", 2, flat=True)
    check_env_specs(team)
    assert team.group_map == {"defender": team.envs.agents}
    assert team.full_action_spec["defender", "action"].shape == (2, len(team.envs.agents))
    envs: Any = gymnasium.make_vec("cps_envs/FdiDefense-v0", 2, autoreset="same_step", per_agent=True, flat=True)
    rows, _ = envs.reset(seed=5)
    team._first = 5
    seen = team.reset()["defender", "observation"]
    torch.testing.assert_close(seen.flatten(0, 1), torch.as_tensor(rows))


@pytest.mark.parametrize("problem", SHORT)
def test_an_episode_is_that_of_the_parallel_interface(problem: str) -> None:
    """The same seed and actions: equal observations, rewards and ends, whoever plays beside it."""
    import torch

    env = duel(problem)
    parallel = import_module(f"cps_envs.{problem}_v0").parallel_env(**SHORT[problem])
    env.set_seed(0)
    env._cut[:] = 0  # whole episodes from the start
    seen = env.reset()
    observations, _ = parallel.reset(seed=2_000_001)
    groups = {role: [name for name in parallel.possible_agents if name.startswith(role)] for role in ROLES}
    torch.manual_seed(0)
    while parallel.agents:
        for role, names in groups.items():
            shown = np.stack([observations[name] for name in names])
            np.testing.assert_array_equal(seen[role, "observation"][1].numpy(), shown)
        step = env.step(env.rand_action(seen))
        actions = {
            name: step[role, "action"][1, place].numpy()
            for role, names in groups.items()
            for place, name in enumerate(names)
        }
        observations, rewards, terminations, _, _ = parallel.step(actions)
        for role, names in groups.items():
            paid = step["next", role, "reward"][1, :, 0].numpy()
            np.testing.assert_allclose(paid, [rewards[name] for name in names], atol=1e-5)
        assert bool(step["next", "terminated"][1]) == all(terminations.values())
        seen = env.maybe_reset(env.step_mdp(step))  # others may end earlier, and begin anew


def test_first_episodes_end_at_different_times() -> None:
    env = duel("fdi", num_envs=16)
    played = env.rollout(20, break_when_any_done=False)
    truncated, terminated = (played["next", name][..., 0] for name in ("truncated", "terminated"))
    assert not (truncated & terminated).any()
    assert len(set(truncated.nonzero()[:, 1].tolist())) > 3
    assert truncated.sum(1).max() <= 1
    again = duel("fdi", num_envs=16)
    assert (again.reset()["attacker", "observation"] == env.reset()["attacker", "observation"]).float().mean() < 1


@pytest.fixture
def self_play(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    return import_module("torchrl_self_play")


@pytest.mark.parametrize("problem", ["fdi", "rogue"])
def test_self_play_prints_a_row_for_each_judgement(self_play: Any, problem: str, tmp_path: Path) -> None:
    tiny = {"cpu_seconds": 0.01, "num_envs": 4, "num_steps": 2, "judgements": 1, "episodes": 2}
    rows = self_play.train(self_play.Args(problem=problem, out=str(tmp_path), **tiny))
    assert len(rows) == 2
    assert np.isfinite(rows).all()
    assert {path.parent.name for path in tmp_path.rglob("policy.json")} == {
        f"{problem}-attacker",
        f"{problem}-defender",
    }


@pytest.mark.slow
def test_both_sides_get_better(self_play: Any, tmp_path: Path) -> None:
    rows = self_play.train(self_play.Args(cpu_seconds=60.0, judgements=1, out=str(tmp_path)))
    (_, attack, defense), (_, better_attack, better_defense) = rows
    assert better_attack > attack + 0.4  # m/s against cusum
    assert better_defense < defense - 0.4  # against the usual attackers
